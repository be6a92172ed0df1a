"""Lays out the legend of several load cases, outside of the panels that it is for."""

from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from reports.base import style
from reports.figures.loading_path.abscissa import load_names, structures
from reports.study import StudyResults, display_name

CASE_STYLES = (
    ("-", 0.0),
    ((0, (4.0, 1.5)), 0.3),
    ((0, (1.2, 1.2)), 0.45),
    ((0, (5.0, 1.2, 1.2, 1.2)), 0.55),
)
"""Dashes and share of white of the curves of one load case after the other."""
LEFT, ACROSS = 11.0, style.TWO_COLUMNS - 14.0
"""Left side of the legend and its width, mm."""
_LINE, _HANDLE, _LETTER = 3.4, 6.5, 1.1
"""Of a legend, mm: height of a line, room of a handle, mean width of a letter."""


def curve_style(structure: str, case: int) -> dict[str, Any]:
    """Returns colour, width and dashes of a structure's curve under a load case."""
    dashes, white = CASE_STYLES[case % len(CASE_STYLES)]
    colour = style.tinted(style.STRUCTURE_COLOURS[structure], white)
    return {"color": colour, "lw": 1.8 if structure == "intact" else 1.2, "ls": dashes}


@dataclass(frozen=True)
class LoadLegend:
    """Holds the entries of a legend column by column; none of one load case.

    Of one load case the few entries have room beside the curves.
    """

    entries: list[Line2D]
    columns: int

    @classmethod
    def of(cls, study: StudyResults) -> "LoadLegend":
        """Returns the legend of a study: a line for each structure, or for each load case."""
        shown, loads = structures(study.response), load_names(study.problem, study.response)
        if len(loads) == 1:
            return cls([], 1)
        titles = [display_name(study.problem, name) for name in shown]
        longest = max(map(len, titles)) + len(", ") + max(map(len, loads))
        most = max(int(ACROSS // (_HANDLE + _LETTER * longest)), 1)
        by_load = _lines(len(shown), len(loads), most) <= _lines(len(loads), len(shown), most)
        pairs = [(k, case) for case in range(len(loads)) for k in range(len(shown))]
        entries = [
            Line2D([], [], label=f"{titles[k]}, {loads[case]}", **curve_style(shown[k], case))
            for k, case in (pairs if by_load else sorted(pairs))
        ]
        lines = _lines(*((len(shown), len(loads)) if by_load else (len(loads), len(shown))), most)
        return cls(entries, -(-len(entries) // lines))

    @property
    def height(self) -> float:
        """Returns the room that the legend takes, mm."""
        return _LINE * -(-len(self.entries) // self.columns)

    def draw(self, figure: Figure, top: float) -> None:
        """Draws the legend `top` mm below the upper edge of the page."""
        if not self.entries:
            return
        width, height = figure.get_size_inches() * style.MM_PER_INCH
        figure.legend(
            handles=self.entries, loc="upper left", ncols=self.columns, columnspacing=1.2,
            handlelength=2.2, borderaxespad=0.0, borderpad=0.0, labelspacing=0.35,
            bbox_to_anchor=(LEFT / width, 1.0 - top / height),
        )  # fmt: skip


def _lines(height: int, blocks: int, most: int) -> int:
    """Counts the lines of columns that hold blocks of some height, of at `most` so many columns."""
    return height * -(-blocks // most)
