"""Describes structures along the path, true to scale, side by side and above one another."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pipeline.problem import Problem
from reports.base import style
from reports.figures.loading_path.abscissa import (
    SECOND,
    Abscissa,
    abscissa_of,
    load_names,
    structures,
)
from reports.figures.loading_path.structure_panels import UnitColouring, shade_of
from reports.panels import colour_bar, draw
from reports.study import StudyResults, display_name, from_dataset

LABEL, BAR, GAP = 6.0, 14.0, 1.2
"""Room for labels left of snapshots and for the bar of colours, and between snapshots; mm."""
LARGEST = 44.0
"""Side of a snapshot where there is room, mm."""

Label = tuple[str, str]


@dataclass(frozen=True)
class SnapshotStructure:
    """Holds one structure among the snapshots: its name, the colour of that, and what it does.

    `case` is the load case shown.
    """

    label: str
    colour: str
    part: xr.Dataset
    case: int = 0


def rows(study: StudyResults) -> list[SnapshotStructure]:
    """Lists the structures of a study, recordings above them, and the second design."""
    response, problem = study.response, study.problem
    along, found = abscissa_of(problem, response).values, []
    loads = load_names(problem, response)
    for name in structures(response):
        label, colour = display_name(problem, name), style.STRUCTURE_COLOURS[name]
        filmed = [each for each in study.recordings if each.structure == name]
        for each in filmed:
            part = each.motion(response, along)
            found.append(SnapshotStructure(f"{label}\n{each.source}", colour, part))
        label = f"{label}\nsimulation" if filmed else label
        for case, load in enumerate(loads):
            told = label if len(loads) == 1 else f"{label}\n{load}"
            found.append(SnapshotStructure(told, colour, response.sel(structure=name), case))
    if study.redesign is not None and study.redesign.changed:
        part = study.redesign.response.sel(structure="cloaked")
        for case, load in enumerate(loads):
            told = SECOND if len(loads) == 1 else f"{SECOND}\n{load}"
            found.append(SnapshotStructure(told, style.CLOAKED, part, case))
    return found


@dataclass(frozen=True)
class SnapshotLayout:
    """Tells how the snapshots are laid out: structures above one another or side by side; mm."""

    rows: list[SnapshotStructure]
    path: Abscissa
    side: float
    beside: bool

    @classmethod
    def of(cls, study: StudyResults, path: Abscissa, tallest: float) -> "SnapshotLayout":
        """Returns the layout that shows them larger."""
        kinds, loads = rows(study), len(path.shown)
        across = style.TWO_COLUMNS - LABEL - BAR

        def side(columns: int, lines: int) -> float:
            return min(across / columns, tallest / lines, LARGEST)

        above, beside = side(loads, len(kinds)), side(len(kinds), loads)
        return cls(kinds, path, max(above, beside), beside > above)

    @property
    def lines(self) -> int:
        """Returns number of snapshots above one another."""
        return len(self.path.shown) if self.beside else len(self.rows)

    @property
    def columns(self) -> int:
        """Returns number of snapshots side by side."""
        return len(self.rows) if self.beside else len(self.path.shown)

    @property
    def left(self) -> float:
        """Tells where the snapshots begin so that all of them are in the middle."""
        return LABEL + (style.TWO_COLUMNS - LABEL - BAR - self.columns * self.side) / 2

    def at(self, row: int, load: int) -> tuple[int, int]:
        """Returns line and column of a snapshot."""
        return (load, row) if self.beside else (row, load)


Overlay = Callable[[Axes, SnapshotStructure, int], None]


def snapshots(
    figure: Figure,
    study: StudyResults,
    grid: SnapshotLayout,
    top: float,
    overlay: Overlay | None = None,
) -> None:
    """Draws all structures at all loads shown, from ``top`` (mm) on, an ``overlay`` on each."""
    shade, side = shade_of(study.problem, study.response), grid.side
    for k, row in enumerate(grid.rows):
        for m, sample in enumerate(grid.path.shown):
            line, column = grid.at(k, m)
            axes = style.place(
                figure, grid.left + column * side, top + line * side, side - GAP, side - GAP
            )
            snapshot(axes, study.problem, row.part, sample, shade, row.case)
            if overlay is not None:
                overlay(axes, row, sample)
    loads = [f"{grid.path.symbol} = {grid.path.at(sample)}" for sample in grid.path.shown]
    kinds = [(row.label, row.colour) for row in grid.rows]
    values = [(load, style.INTACT) for load in loads]
    _labels(figure, grid, top, *((kinds, values) if grid.beside else (values, kinds)))
    end = grid.left + grid.columns * side
    shade_bar(figure, shade, (end + 1.5, top, grid.lines * side - GAP))


def _labels(
    figure: Figure, grid: SnapshotLayout, top: float, above: Sequence[Label], left: Sequence[Label]
) -> None:
    for k, (text, colour) in enumerate(above):
        x = grid.left + (k + 0.5) * grid.side - GAP / 2
        style.write(
            figure, x, top - 0.8, text, ha="center", va="bottom", color=colour,
            fontsize=style.SMALL if "\n" in text else style.TEXT, multialignment="center",
        )  # fmt: skip
    for k, (text, colour) in enumerate(left):
        y = top + (k + 0.5) * grid.side - GAP / 2
        size = style.SMALL if "\n" in text else style.TEXT
        style.write_upwards(figure, grid.left - 1.5, y, text, color=colour, fontsize=size)


def snapshot(
    axes: Axes, problem: Problem, part: xr.Dataset, sample: int, shade: UnitColouring, case: int = 0
) -> None:
    """Draws one structure at one sample of its path, true to scale."""
    structure = from_dataset(part, problem.lattice.spacing)
    frame = part["displacement"].isel(case=case, time=sample).transpose("unit", "dof").values
    values = shade.values(frame)
    draw(axes, structure, frame, values=values, colour_map=shade.colours, norm=shade.norm)


def shade_bar(figure: Figure, shade: UnitColouring, place: tuple[float, float, float]) -> None:
    """Draws the bar of the snapshots, in `place`: mm from the left and the top, and height."""
    bar = colour_bar(figure, shade.norm, shade.colours, place, shade.label).ax
    bar.yaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))
    bar.yaxis.set_major_formatter(lambda value, _: f"{value:g}".replace("-", "−"))
