"""Datasets with the schema of a real study and a motion in closed form, in a second.

The motion is that of an elastic sheet pulled at its centre: displacement falls off as a logarithm
with the distance, neighbours counter-rotate, everything swings in phase with the drive.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from sim.lattice import Lattice, quads

SPACING, LIGAMENT, BIAS = 15.0, 2.25, np.radians(20.0)
AMPLITUDE, FREQUENCY = 4.5, 2.0
DIRECTIONS = (0.0, 45.0, 90.0, 135.0)


@dataclass(frozen=True)
class Study:
    """The three datasets of a study."""

    design: xr.Dataset
    response: xr.Dataset
    sweep: xr.Dataset


def study(
    size: int = 15,
    directions: tuple[float, ...] = DIRECTIONS,
    samples: int = 401,
    sweep_points: tuple[int, int] = (13, 15),
    evaluations: int = 120,
) -> Study:
    lattice = quads(size, size, SPACING, LIGAMENT, BIAS)
    attributes = {
        "problem": json.dumps(problem(size, directions, samples, sweep_points), sort_keys=True),
        "problem_hash": "0" * 64,
        "schema_version": "1",
    }
    parts = (
        _design(lattice, directions, evaluations),
        _response(lattice, directions, samples),
        _sweep(sweep_points),
    )
    return Study(*(_described(part.assign_attrs(attributes)) for part in parts))


def problem(
    size: int, directions: tuple[float, ...], samples: int, sweep_points: tuple[int, int]
) -> dict[str, Any]:
    return {
        "title": "Shielding dynamic excitations",
        "doc": "A made-up study.",
        "lattice": {
            "kind": "quads",
            "columns": size,
            "rows": size,
            "spacing": SPACING,
            "ligament_length": LIGAMENT,
            "bias_angle": BIAS,
        },
        "drive": {
            "units": "centre",
            "kind": "harmonic",
            "amplitude": AMPLITUDE,
            "frequency": FREQUENCY,
            "directions": [float(np.radians(angle)) for angle in directions],
            "weights": [1.0 / len(directions)] * len(directions),
        },
        "horizon": {"periods": 2},
        "samples": 200,
        "cloak": {"disc": {"centre": "centre", "radius": _radius(size)}},
        "response": {"cycles": 4, "samples": samples},
        "solver": {"accuracy": "default", "integrator": "auto"},
        "sweep": {
            "direction": {"from": 0.0, "to": float(np.pi), "points": sweep_points[0]},
            "frequency": {"from": 2.0, "to": 16.0, "points": sweep_points[1]},
            "periods": 2,
        },
    }


def _radius(size: int) -> float:
    return (4.5 if size >= 15 else 1.5) * SPACING


def _middle(lattice: Lattice) -> np.ndarray:
    return 0.5 * (lattice.site.min(axis=0) + lattice.site.max(axis=0))


def _flags(lattice: Lattice) -> dict[str, Any]:
    distance = np.linalg.norm(lattice.site - _middle(lattice), axis=1)
    size = int(lattice.index.max()) + 1
    region = np.where(distance < _radius(size), 1, 0)
    region[np.argmin(distance)] = 2
    support = np.zeros(lattice.n_units, int)
    support[[0, size - 1, size * (size - 1), size * size - 1]] = 1
    support[np.argmin(distance)] = 2
    return {
        "region": ("unit", region.astype("int8")),
        "roi": ("unit", (region == 0).astype("int8")),
        "support": ("unit", support.astype("int8")),
        "ligament_unit": (("ligament", "end"), lattice.ligament_units),
        "ligament_vertex": (("ligament", "end"), lattice.ligaments % 4),
    }


def _coordinates(lattice: Lattice) -> dict[str, Any]:
    return {
        "unit": np.arange(lattice.n_units),
        "i": ("unit", lattice.index[:, 0]),
        "j": ("unit", lattice.index[:, 1]),
        "xy": ["x", "y"],
    }


def _cloaked(lattice: Lattice) -> np.ndarray:
    """Vertices of a four-fold symmetric design: a harder turn of the units around the source."""
    middle = _middle(lattice)
    ends = lattice.vertices[lattice.ligaments].mean(axis=1) - middle
    away = np.linalg.norm(ends, axis=1) / _radius(int(lattice.index.max()) + 1)
    strength = np.where(away < 0.98, np.sin(np.pi * away) * (away - 0.4) * 3.0, 0.0)
    turn = strength[:, None] * np.stack([-ends[:, 1], ends[:, 0]], axis=1)
    turn /= np.maximum(np.linalg.norm(ends, axis=1), 1.0)[:, None]
    moved = lattice.vertices.copy()
    for column in range(2):
        moved[lattice.ligaments[:, column]] += turn
    return moved


def _design(lattice: Lattice, directions: tuple[float, ...], evaluations: int) -> xr.Dataset:
    rng = np.random.default_rng(0)
    step = np.arange(evaluations)
    loss = np.stack(
        [
            0.05 + 2.104 * np.exp(-(step**0.6) / 1.6),
            0.19 + 1.964 * np.exp(-(step**0.7) / 4.0),
        ]
    )
    loss[1, evaluations // 2 :] = np.nan
    accepted = np.isfinite(loss) & (rng.random(loss.shape) > 0.15)
    accepted[:, 0] = True
    loss = np.where(accepted, loss, 1.6 * loss)
    violation = np.where(np.isnan(loss), np.nan, 0.0)
    violation[1, 4 : evaluations // 4] = 0.02
    spread = 1.0 + 0.12 * np.cos(2 * np.pi * np.arange(len(directions)) / 2)
    feasible = np.where(accepted & (violation <= 0), loss, np.inf)
    vertices = lattice.padded(_cloaked(lattice))
    return xr.Dataset(
        _flags(lattice)
        | {
            "vertices": (("unit", "vertex", "xy"), vertices),
            "vertices_initial": (("unit", "vertex", "xy"), lattice.padded(lattice.vertices)),
            "centroid": (("unit", "xy"), np.nanmean(vertices, axis=1)),
            "loss": (("method", "evaluation"), loss),
            "loss_case": (("method", "evaluation", "case"), loss[..., None] * spread),
            "violation": (("method", "evaluation"), violation),
            "accepted": (("method", "evaluation"), accepted.astype("int8")),
            "best_evaluation": ("method", feasible.argmin(axis=1)),
            "best_loss": ("method", feasible.min(axis=1)),
            "kkt_residual": ("method", np.array([2e-4, 3e-2])),
            "constraint_margin": ("constraint", np.array([0.0, 0.01, 0.0, 0.3, 0.11])),
            "smallest_gap": ((), 0.11),
            "overlaps": ((), 0),
        },
        _coordinates(lattice)
        | {
            "method": ["sqp", "mma"],
            "direction": ("case", np.array(directions)),
            "constraint": ["edge_length", "block_angle", "void_angle", "convexity", "gap"],
        },
        {"shipped_method": "sqp"},
    )


def _response(lattice: Lattice, directions: tuple[float, ...], samples: int) -> xr.Dataset:
    time = np.linspace(0.0, 4.0 / FREQUENCY, samples)
    motion = np.stack([_motion(lattice, directions, time, reach) for reach in (1.0, 0.12)])
    roi = _flags(lattice)["roi"][1].astype(bool)
    scaled = motion[..., roi, :] / np.array([SPACING, SPACING, 1.0])
    horizon = time <= 2.0 / FREQUENCY * (1 + 1e-9)
    power = (scaled**2).sum(axis=(-1, -2))[..., horizon]
    loss = np.trapezoid(power, time[horizon], axis=-1) / time[horizon][-1]
    per_time = ("structure", "case", "time")
    per_case = ("structure", "case")
    shapes = np.stack([lattice.padded(lattice.vertices), lattice.padded(_cloaked(lattice))])
    return xr.Dataset(
        _flags(lattice)
        | {
            "vertices": (("structure", "unit", "vertex", "xy"), shapes),
            "displacement": ((*per_time, "unit", "dof"), motion),
            "min_void_angle": (per_time, np.full(motion.shape[:3], 0.2) - 0.1 * time),
            "min_gap": (per_case, np.full(loss.shape, 0.08)),
            "overlaps": (per_case, np.zeros(loss.shape, int)),
            "loss": (per_case, loss),
            "loss_samples": (per_case, 0.995 * loss),
            "loss_error": (per_case, np.full(loss.shape, 3e-5)),
            "displacement_error": (per_case, np.full(loss.shape, 2e-3)),
        },
        _coordinates(lattice)
        | {
            "structure": ["altered", "cloaked"],
            "time": time,
            "dof": ["ux", "uy", "theta"],
            "direction": ("case", np.array(directions)),
            "frequency": ("case", np.full(len(directions), FREQUENCY)),
            "amplitude": ("case", np.full(len(directions), AMPLITUDE)),
        },
    )


def _motion(
    lattice: Lattice, directions: tuple[float, ...], time: np.ndarray, reach: float
) -> np.ndarray:
    """Displacement (case, time, unit, 3) in mm, mm, rad."""
    away = lattice.site - _middle(lattice)
    radius = np.linalg.norm(away, axis=1)
    share = np.clip(1 - np.log1p(radius / SPACING) / np.log1p(radius.max() / SPACING), 0.0, 1.0)
    share = np.where(radius < 1e-9, 1.0, reach * share)
    sign = np.where(lattice.index.sum(axis=1) % 2 == 0, 1.0, -1.0)
    swing = np.sin(2 * np.pi * FREQUENCY * time)[:, None]
    cases = []
    for direction in np.radians(directions):
        pull = np.array([np.cos(direction), np.sin(direction)])
        turn = sign * share * (away @ pull) / np.maximum(radius, 1.0) * 0.35
        turn = np.where(radius < 1e-9, 0.0, turn)
        form = np.column_stack([AMPLITUDE * share * pull[0], AMPLITUDE * share * pull[1], turn])
        cases.append(swing[..., None] * form)
    return np.stack(cases)


def _sweep(points: tuple[int, int]) -> xr.Dataset:
    direction, frequency = np.linspace(0, 180, points[0]), np.linspace(2, 16, points[1])
    angle = np.radians(direction)[:, None]
    loss = 0.05 + 0.06 * ((frequency - 2) / 14) ** 2 * (1.0 + 0.25 * np.cos(4 * angle))
    dims = ("direction", "frequency")
    return xr.Dataset(
        {
            "loss": (dims, loss),
            "loss_altered": (dims, 20.0 * loss),
            "status": (dims, np.full(loss.shape, "ok", dtype=object)),
            "min_void_angle": (dims, np.full(loss.shape, -0.1)),
        },
        {"direction": direction, "frequency": frequency},
    )


_UNITS = {
    "vertices": "mm",
    "vertices_initial": "mm",
    "centroid": "mm",
    "time": "s",
    "direction": "degree",
    "frequency": "Hz",
    "amplitude": "mm",
    "min_void_angle": "rad",
    "smallest_gap": "mm",
    "min_gap": "mm",
}


def _described(data: xr.Dataset) -> xr.Dataset:
    for name in data.variables:
        text = str(name)
        if data[name].dtype.kind in "fi":
            data[name].attrs = {"units": _UNITS.get(text, "1"), "long_name": text}
    return data
