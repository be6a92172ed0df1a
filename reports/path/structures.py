"""Panels that show structures: at rest with their regions, and along the path."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pipeline.problem import Problem
from pipeline.problem.regions import Region
from reports import style
from reports.path.course import Course, display_name, structures
from reports.player import Field, round_up
from reports.structure import (
    CLAMPED,
    CLOAK,
    DRIVEN,
    INCLUSION,
    Structure,
    draw,
    draw_clamps,
    from_dataset,
)

Array = NDArray[np.float64]

CLOAK_TINT, UNIT_TINT, CLAMP_TINT, DRIVE_TINT = "#c9b3e0", "#d9dce0", "#4a4d52", "#f2c48d"
INTEREST_TINT, RIGID_TINT = "#b7dcb2", "#8d9299"


@dataclass(frozen=True)
class Shade:
    """How a displacement (n_units, 3) colours the units."""

    field: Field
    label: str
    colours: Colormap

    def values(self, displacement: Array) -> Array:
        """The number (n_units,) that each unit shows."""
        if self.field.key == "norm":
            size: Array = np.linalg.norm(displacement / np.array(self.field.scale), axis=-1)
            return size
        column = {"ux": 0, "uy": 1, "theta": 2, "turn": 2}[self.field.key]
        shown = self.field.factor * displacement[..., column]
        return np.abs(shown) if self.field.key == "turn" else shown

    @property
    def norm(self) -> Normalize:
        """From the lowest to the highest colour."""
        return Normalize(*self.field.limits)


def shade_of(problem: Problem, response: xr.Dataset) -> Shade:
    """What colours the snapshots: |theta|, u_y or |U|, by what the cloak is for."""
    free = response["displacement"].isel(unit=response["support"].values == 0).values
    if problem.objective.kind == "strain_energy":
        most = round_up(float(np.degrees(np.nanmax(np.abs(free[..., 2])))))
        field = Field("turn", "|θ|", "°", 180.0 / np.pi, "magnitude", (0.0, most))
        return Shade(field, r"$|\theta|$ (°)", style.MAGNITUDE)
    if problem.objective.target != "rest":
        most = round_up(float(np.nanmax(np.abs(free[..., 1]))))
        field = Field("uy", "u_y", "mm", 1.0, "signed", (-most, most))
        return Shade(field, "$u_y$ (mm)", style.SIGNED)
    scale = (problem.lattice.spacing, problem.lattice.spacing, 1.0)
    most = round_up(float(np.nanmax(np.linalg.norm(free / np.array(scale), axis=-1))))
    field = Field("norm", "|U|", "", 1.0, "magnitude", (0.0, most), scale)
    return Shade(field, r"$\|\mathbf{U}\|$", style.MAGNITUDE)


def rest_panel(axes: Axes, problem: Problem, response: xr.Dataset, name: str) -> None:
    """One structure at rest: what is clamped, driven, looked at and redesigned."""
    structure = from_dataset(response.sel(structure=name), problem.lattice.spacing)
    interest = np.zeros(structure.n_units, dtype=bool)
    if isinstance(problem.objective.region, Region):
        interest = response["roi"].values.astype(bool)
    draw_clamps(axes, structure, problem.lattice.spacing)
    draw(axes, structure, colours=list(_tints(structure, interest, name)), margin=12.0)
    if name != "intact" and not np.isnan(float(response["direction"][0])):
        _load_arrows(axes, structure, float(response["direction"][0]))


def _tints(structure: Structure, interest: NDArray[np.bool_], name: str) -> Iterator[str]:
    for region, support, looked_at in zip(
        structure.region, structure.support, interest, strict=True
    ):
        if support == CLAMPED:
            yield CLAMP_TINT
        elif support == DRIVEN:
            yield DRIVE_TINT
        elif region == CLOAK and name == "cloaked":
            yield CLOAK_TINT
        elif region == INCLUSION and name != "intact":
            yield RIGID_TINT
        else:
            yield INTEREST_TINT if looked_at else UNIT_TINT


def _load_arrows(axes: Axes, structure: Structure, direction: float) -> None:
    """Arrows onto some of the driven units, along the drive."""
    ends = structure.centroid[structure.present & (structure.support == DRIVEN)]
    along = np.array([np.cos(np.radians(direction)), np.sin(np.radians(direction))])
    few = np.unique(np.linspace(0, len(ends) - 1, 5).round().astype(int))
    reach = 0.055 * float(np.ptp(structure.centroid[structure.present], axis=0).max())
    for x, y in ends[few[1:-1] if len(few) == 5 else few]:
        start = np.array([x, y]) - 1.3 * reach * along
        end = np.array([x, y]) - 0.3 * reach * along
        arrow = FancyArrowPatch(
            (float(start[0]), float(start[1])),
            (float(end[0]), float(end[1])),
            arrowstyle="-|>",
            mutation_scale=6.0,
            shrinkA=0,
            shrinkB=0,
            linewidth=1.3,
            color=style.ALTERED,
            zorder=7,
            clip_on=False,
        )
        axes.add_patch(arrow)


def snapshots(
    figure: Figure, problem: Problem, response: xr.Dataset, course: Course,
    place: tuple[float, float],
) -> None:  # fmt: skip
    """A row a structure, a column a load, in `place`: mm from the top, and height."""
    top, height = place
    names, shade = structures(response), shade_of(problem, response)
    label, bar, gap = 6.0, 14.0, 1.2
    count = len(course.shown)
    side = min((style.TWO_COLUMNS - label - bar) / count, height / len(names))
    left = label + (style.TWO_COLUMNS - label - bar - count * side) / 2
    for k, name in enumerate(names):
        y = top + k * side
        style.write(
            figure, left - 1.5, y + side / 2, display_name(problem, name), rotation=90,
            ha="right", va="center", color=style.STRUCTURE_COLOURS[name], fontsize=style.TEXT,
        )  # fmt: skip
        for m, sample in enumerate(course.shown):
            axes = style.place(figure, left + m * side, y, side - gap, side - gap)
            snapshot(axes, problem, response.sel(structure=name), sample, shade)
            if k == 0:
                axes.set_title(
                    f"{course.symbol} = {course.at(sample)}", fontsize=style.TEXT, pad=1.0
                )
    colour_bar(figure, shade, (left + count * side + 1.5, top, len(names) * side - gap))


def snapshot(
    axes: Axes, problem: Problem, part: xr.Dataset, sample: int, shade: Shade, case: int = 0
) -> None:
    """One structure at one sample of its path, true to scale."""
    structure = from_dataset(part, problem.lattice.spacing)
    frame = part["displacement"].isel(case=case, time=sample).transpose("unit", "dof").values
    draw(
        axes,
        structure,
        frame,
        values=shade.values(np.nan_to_num(frame)),
        colour_map=shade.colours,
        norm=shade.norm,
    )


def colour_bar(figure: Figure, shade: Shade, place: tuple[float, float, float]) -> None:
    """The bar of the snapshots, in `place`: mm from the left and the top, and height."""
    left, top, height = place
    bar = style.place(figure, left, top + 0.1 * height, 2.4, 0.8 * height)
    figure.colorbar(ScalarMappable(shade.norm, shade.colours), cax=bar).set_label(
        shade.label, labelpad=1.5
    )
    bar.yaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))
    bar.yaxis.set_major_formatter(lambda value, _: f"{value:g}".replace("-", "−"))
    bar.tick_params(length=1.5)
