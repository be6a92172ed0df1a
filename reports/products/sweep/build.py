"""Draws a sweep over any parameters: the figure (PDF, SVG, PNG), its cases as CSV, and one page.

The same dataset gives the same bytes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from pipeline import datasets, problem
from pipeline.runtime import UserError, cli
from reports.base import drawn
from reports.page import figure_page
from reports.products.sweep import cases, content, figure
from reports.study import draft, study_results

_MAPS = (
    "(a) Loss of the cloaked structure, (b) over that of the altered one, (c) smallest void angle"
    " of the cloaked structure; one cell for each case. Crosses mark cases that failed."
)
_POINTS = (
    "(a) Loss of the altered and of the cloaked structure, (b) the second over the first, (c)"
    " smallest void angle of the cloaked structure. Each row is over one parameter, whatever the"
    " others are. Thick lines, where there are enough cases, are medians of a tenth of them each."
    " Crosses mark cases that failed."
)


def _work(args: argparse.Namespace) -> None:

    whole = problem.load(args.problem)
    asked = problem.load(args.problem, args.preset) if args.preset else whole
    sweep = asked.sweep
    if sweep is None:
        remedy = "add sweep.grid, sweep.list or sweep.random"
        what = "the problem asks for no sweep"
        raise UserError(what, file=args.problem, key="sweep", remedy=remedy)
    data = datasets.read(args.sweep, "sweep")
    study_results.check_problem(asked, "sweep", data, args.sweep)
    made = figure_page.FigurePage(
        name="sweep",
        title=asked.title or args.problem.resolve().parent.name,
        subject="sweep",
        lead="One design at many settings of the problem's parameters, simulated; the design itself"
        " stays as it is.",
        caption=_MAPS if cases.mapped(sweep) else _POINTS,
        figure=lambda: figure.draw_sweep(data, sweep),
        tables=content.tables(data),
        sources=data.attrs,
        datasets=["../sweep.nc", "../design.nc"],
        shown=content.shown(data),
        draft=draft.reasons(asked, whole),
    )
    figure_page.publish_figure_page(made, args.out_dir)


def main(argv: Sequence[str] | None = None) -> int:
    """Draw the sweep; returns the exit code."""
    parser = cli.parser("reports.products.sweep.build", str(__doc__))
    drawn(parser, "sweep")
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
