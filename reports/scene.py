"""What the figures need to know of a study's problem, read from the datasets themselves."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scene:
    """A harmonically driven lattice.

    Lengths in mm, times in s, frequencies in Hz, directions in degrees. The loss is taken over
    `horizon`; `radii` bound the cloak; `middle` is the lattice's centre.
    """

    title: str
    columns: int
    rows: int
    spacing: float
    amplitude: float
    frequency: float
    directions: tuple[float, ...]
    horizon: float
    radii: tuple[float, ...]
    middle: tuple[float, float]
    accuracy: str

    @property
    def period(self) -> float:
        """Of the drive, s."""
        return 1.0 / self.frequency

    @property
    def scale(self) -> Array:
        """Divisors (3,) that make (ux, uy, theta) dimensionless: U = (ux/s, uy/s, theta)."""
        return np.array([self.spacing, self.spacing, 1.0])


def of(data: xr.Dataset) -> Scene:
    """Scene described by the `problem` attribute of a dataset."""
    problem = json.loads(data.attrs["problem"])
    lattice, drive = problem["lattice"], problem["drive"]
    spacing = float(lattice["spacing"])
    sides = (lattice["columns"], lattice["rows"])
    return Scene(
        title=problem["title"],
        columns=int(lattice["columns"]),
        rows=int(lattice["rows"]),
        spacing=spacing,
        amplitude=float(drive["amplitude"]),
        frequency=float(drive["frequency"]),
        directions=tuple(round(float(np.degrees(angle)), 9) for angle in drive["directions"]),
        horizon=_horizon(problem["horizon"], float(drive["frequency"])),
        radii=_radii(problem["cloak"]),
        middle=(0.5 * (sides[0] - 1) * spacing, 0.5 * (sides[1] - 1) * spacing),
        accuracy=str(problem.get("solver", {}).get("accuracy", "default")),
    )


def _horizon(horizon: dict[str, Any], frequency: float) -> float:
    if horizon.get("periods") is not None:
        return float(horizon["periods"]) / frequency
    return float(horizon["duration"])


def _radii(cloak: dict[str, Any]) -> tuple[float, ...]:
    if cloak.get("disc") is not None:
        return (float(cloak["disc"]["radius"]),)
    return (float(cloak["ring"]["inner"]), float(cloak["ring"]["outer"]))


def draft_reasons(scene: Scene, response: xr.Dataset, sweep: xr.Dataset) -> list[str]:
    """Why this is a quick look and not Figure 2 of the paper; empty if it is the full study."""
    checks = {
        f"{scene.columns}×{scene.rows} units instead of 15×15": scene.columns * scene.rows < 225,
        f"{response.sizes['case']} load cases instead of 4": response.sizes["case"] < 4,
        (
            f"map of {sweep.sizes['direction']}×{sweep.sizes['frequency']} points instead of 13×15"
        ): sweep.sizes["direction"] < 13 or sweep.sizes["frequency"] < 15,
        "accuracy: draft": scene.accuracy == "draft",
        f"{cycles(scene, response):.3g} drive cycles instead of 4": cycles(scene, response) < 3.99,
    }
    return [reason for reason, holds in checks.items() if holds]


def cycles(scene: Scene, response: xr.Dataset) -> float:
    """Number of drive cycles that a response covers."""
    time = response["time"].values
    return float((time[-1] - time[0]) * scene.frequency)
