"""Draws the tables of docs/benchmarks.md as docs/benchmarks.svg: `python -m benchmarks.picture`."""

import re
from itertools import cycle
from pathlib import Path
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.base import style

PAGE = Path(__file__).resolve().parent.parent / "docs/benchmarks.md"
_TABLE = re.compile(r"^```\n(\w+): .*?\n  -+\n(.*?)```", re.MULTILINE | re.DOTALL)
_ROW = re.compile(r"^  (\S.*?)  +([\d.]+) +(?:\d+ %|-) +[\d.]+ +[\d.]+ +([\d.e-]+) ", re.MULTILINE)
_BASELINE = ("diffrax", "pseudo-dynamics")
_SIDES = (("right", -5), ("left", 5))  # of a point: alignment and offset of its label, points


class TableRow(NamedTuple):
    """Holds a method's time, s, and its first error, relative."""

    name: str
    time: float
    error: float


def tables(text: str) -> dict[str, list[TableRow]]:
    """Reads the tables of the page, by the names of their suites."""
    return {
        scene: [
            TableRow(name, float(time), float(error)) for name, time, error in _ROW.findall(rows)
        ]
        for scene, rows in _TABLE.findall(text)
    }


def figure(measured: dict[str, list[TableRow]]) -> Figure:
    """Draws the time of loss and gradient beside the baselines, and time against error."""
    drawn = Figure(figsize=(style.TWO_COLUMNS / style.MM_PER_INCH, 2.5))
    left, right = drawn.subplots(1, 2, width_ratios=(1, 1.2))
    _draw_times(left, measured)
    _draw_errors(right, measured["precision"])
    drawn.tight_layout(w_pad=2.0)
    return drawn


def _draw_times(axes: Axes, measured: dict[str, list[TableRow]]) -> None:
    rows = [
        (scene, row)
        for scene in ("fig4", "fig2")
        for row in reversed(measured[scene])
        if not row.name.endswith("loss only")
    ]
    colours = [style.GREY if row.name.startswith(_BASELINE) else style.INTACT for _, row in rows]
    places = range(len(rows))
    axes.barh(places, [row.time for _, row in rows], color=colours, height=0.6)
    axes.set_yticks(
        places, [f"{scene}: {row.name.removesuffix(', diffrax Dopri5')}" for scene, row in rows]
    )
    for place, (_, row) in zip(places, rows, strict=True):
        axes.text(row.time * 1.2, place, f"{row.time:.3g} s", va="center", fontsize=style.SMALL)
    axes.set_xscale("log")
    axes.set_xlim(right=5e3)
    axes.set_xlabel("processor time of loss and gradient, s")


def _draw_errors(axes: Axes, rows: list[TableRow]) -> None:
    for kind, colour in (("implicit", style.INTACT), ("explicit", style.METHOD_COLOURS["mma"])):
        chosen = sorted(
            (row for row in rows if row.name.startswith(kind)), key=lambda row: row.time
        )
        axes.plot(
            [row.time for row in chosen],
            [row.error for row in chosen],
            "o",
            color=colour,
            markersize=4,
            label=kind,
        )
        # on either side in turn: neighbours may be as fast and as accurate
        for row, (align, apart) in zip(chosen, cycle(_SIDES), strict=False):
            name = row.name.removeprefix(f"{kind}, ")
            axes.annotate(
                name,
                (row.time, row.error),
                (apart, 0),
                textcoords="offset points",
                fontsize=style.SMALL,
                ha=align,
                va="center",
            )
    axes.set(xscale="log", yscale="log", xlim=(0.006, 150))
    axes.set_xlabel("processor time of loss and gradient, one direction, s")
    axes.set_ylabel("root mean square error of U, relative")
    axes.legend(loc="lower left")


def main() -> None:
    """Writes the picture."""
    with style.styled():
        figure(tables(PAGE.read_text(encoding="utf-8"))).savefig(
            PAGE.with_suffix(".svg"), metadata={"Creator": "metacloak", "Date": None}
        )


if __name__ == "__main__":
    main()
