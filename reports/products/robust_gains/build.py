"""Draws what designs gain that hold against more: figure (PDF, SVG, PNG), table, one page.

The same dataset gives the same bytes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from pipeline import datasets, problem
from pipeline.runtime import cli
from reports.base import Table, drawn
from reports.page import PageTable, figure_page
from reports.products.robust_gains import figure

if TYPE_CHECKING:
    import xarray as xr

    from reports.page import PageTable

_CAPTION = (
    "(a) Loss under all loads and imperfect copies that a preset asks for: of the altered"
    " structure, of the study's own design, and of the preset's. The copies are others than those"
    " that the design was made with. (b) How the loss changes from the study's own design to the"
    " preset's, under what the preset asks for, and under the study's own drive: the price."
)
_COLUMNS = (
    "preset", "asks for", "loads", "copies", "loss of the study's own design",
    "loss of the preset's design", "gain", "loss under the study's own drive",
)  # fmt: skip


def _work(args: argparse.Namespace) -> None:

    asked = problem.load(args.problem)
    data = datasets.read(args.gains, "gains")
    columns = {str(name): data[name].values for name in data.variables if data[name].dims}
    made = figure_page.FigurePage(
        name="gains",
        title=asked.title or args.problem.resolve().parent.name,
        subject="designs that hold against more",
        lead="Designs that hold against more than the study's own drive, and what each gains over"
        f" the study's own design, whose loss is {float(data['loss_drive']):.4g}.",
        caption=_CAPTION,
        figure=lambda: figure.draw_robust_gains(data),
        tables=[Table("gains.csv", "losses of every preset", columns)],
        sources=data.attrs,
        datasets=["../gains.nc"],
        shown=_shown(data),
    )
    figure_page.publish_figure_page(made, args.out_dir)


def _shown(data: xr.Dataset) -> PageTable:

    return PageTable(_COLUMNS, [_row(data.sel(preset=name)) for name in data["preset"].values])


def _row(data: xr.Dataset) -> tuple[str, ...]:
    plain, own, price = (float(data[name]) for name in ("loss_plain", "loss_own", "price"))
    words = (str(data[name].item()) for name in ("preset", "asks", "loads", "copies"))
    return *words, f"{plain:.4g}", f"{own:.4g}", f"{1 - own / plain:.1%}", f"{price:.4g}"


def main(argv: Sequence[str] | None = None) -> int:
    """Draw the gains; returns the exit code."""
    parser = cli.parser("reports.products.robust_gains.build", str(__doc__))
    drawn(parser, "gains")
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
