"""Describes panels that show structures: at rest with their regions, and along the path."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, Normalize

from pipeline.problem import Problem, selected_units
from pipeline.problem.outlines import Outline
from pipeline.problem.sections import (
    Region,
    RotationDrive,
    TorqueDrive,
    single_drives,
)
from reports.base import style
from reports.figures.loading_path.drive_directions import drive_directions, swings
from reports.panels import (
    CLAMP_TINT,
    CLOAK_TINT,
    ColourField,
    arrow,
    draw,
    draw_clamps,
    scalar,
    signed_field,
    size_field,
    tints,
    turn_field,
)
from reports.study import CLAMPED, CLOAK, DRIVEN, INCLUSION, RigidUnits, from_dataset
from sim.core import Floats

UNIT_TINT, DRIVE_TINT, INTEREST_TINT, RIGID_TINT = "#d9dce0", "#f2c48d", "#b7dcb2", "#8d9299"


@dataclass(frozen=True)
class UnitColouring:
    """Tells how a displacement (n_units, 3) colours the units."""

    field: ColourField
    label: str
    colours: Colormap

    def values(self, displacement: Floats) -> Floats:
        """Returns the number (n_units,) that each unit shows."""
        return scalar(self.field, displacement)

    @property
    def norm(self) -> Normalize:
        """Spans the lowest to the highest colour."""
        return Normalize(*self.field.limits)


def shade_of(problem: Problem, response: xr.Dataset) -> UnitColouring:
    """Returns what colours the snapshots: |theta|, u_y or |U|, by what the cloak is for."""
    free = response["displacement"].isel(unit=response["support"].values == 0).values
    if problem.objective.kind == "strain_energy":
        return UnitColouring(turn_field(free), r"$|\theta|$ (°)", style.MAGNITUDE)
    if problem.objective.target != "rest":
        return UnitColouring(signed_field("uy", free), "$u_y$ (mm)", style.SIGNED)
    field = size_field(free, problem.lattice.spacing)
    return UnitColouring(field, r"$\|\mathbf{U}\|$", style.MAGNITUDE)


def rest_panel(axes: Axes, problem: Problem, response: xr.Dataset, name: str) -> None:
    """Draws one structure at rest: what is clamped, driven, looked at and redesigned."""
    structure = from_dataset(response.sel(structure=name), problem.lattice.spacing)
    held = {CLAMPED: CLAMP_TINT, DRIVEN: DRIVE_TINT}
    altered = {CLOAK: CLOAK_TINT} if name == "cloaked" else {}
    altered |= {INCLUSION: RIGID_TINT} if name != "intact" else {}
    interest = response["roi"].values * isinstance(problem.objective.region, Region)
    others = np.where(interest, INTEREST_TINT, UNIT_TINT).tolist()
    draw_clamps(axes, structure, problem.lattice.spacing)
    margin = max(12.0, 1.2 * _reach(structure))  # arrows begin before the structure
    draw(axes, structure, colours=tints(structure, held, altered, others), margin=margin)
    if name != "intact" and problem.void is not None:
        _draw_outlines(axes, problem.void.outlines(problem.lattice.centre_site))
    for drive in single_drives(problem.drive):
        units = list(selected_units(drive.units, problem.lattice))
        ends = structure.centroid[units]
        if isinstance(drive, TorqueDrive | RotationDrive):
            _turning_signs(axes, "\u21ba" if drive.amplitude > 0 else "\u21bb", ends)
            continue
        ways, both = drive_directions(drive, response, units), swings(drive, response, units)
        _load_arrows(axes, ways, ends, _reach(structure), both=both)


def _draw_outlines(axes: Axes, outlines: tuple[Outline, ...]) -> None:
    """Draws the void as it was asked for, over the units that it removed."""
    for outline in outlines:
        ring = np.array([*outline, outline[0]])
        axes.plot(*ring.T, color=style.ALTERED, lw=0.7, zorder=6)


def _reach(structure: RigidUnits) -> float:
    """Computes the length of the drive's arrows, mm."""
    size = float(np.ptp(structure.centroid[structure.present], axis=0).max())
    return float(max(0.055 * size, 0.8 * size / np.sqrt(structure.present.sum())))


def _turning_signs(axes: Axes, sign: str, ends: Floats) -> None:
    """Draws the sense of turning of a drive into some of its units."""
    for x, y in _some(ends):
        axes.text(x, y, sign, color=style.ALTERED, ha="center", va="center", zorder=7)


def _load_arrows(
    axes: Axes, ways: Sequence[float], ends: Floats, reach: float, *, both: bool
) -> None:
    """Draws arrows onto some of the driven units along ways (rad); with two heads for `both`."""
    far = 1.9 if both else 1.3  # room for a second head
    for angle in ways:
        along = np.array([np.cos(angle), np.sin(angle)])
        for end in _some(ends):
            start, tip = end - far * reach * along, end - 0.3 * reach * along
            made = arrow(axes, start, tip, style.ALTERED, zorder=7, clip_on=False)
            made.set_arrowstyle("<|-|>" if both else "-|>")


def _some(ends: Floats) -> Floats:
    """Selects at most three of the places (n, 2) of driven units."""
    few = np.unique(np.linspace(0, len(ends) - 1, 5).round().astype(int))
    return ends[few[1:-1] if len(few) == 5 else few]
