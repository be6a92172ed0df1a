"""Draws a calibration: fit.pdf, fit.svg and fit.png. The same dataset gives the same bytes."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pipeline import datasets
from pipeline.runtime import cli
from reports.page import publishing
from reports.products.calibration.figure import draw_calibration


def _work(args: argparse.Namespace) -> None:

    made = datasets.read(args.calibration, "calibration")
    publishing.draw(lambda: draw_calibration(made), "fit", args.out_dir)


def main(argv: Sequence[str] | None = None) -> int:
    """Draw the figure; returns the exit code."""
    parser = cli.parser("reports.products.calibration.build", str(__doc__), study=False)
    parser.add_argument("--calibration", type=Path, required=True, metavar="NC", help="to draw")
    parser.add_argument(
        "--out-dir", type=Path, required=True, metavar="FOLDER", help="the figure's folder"
    )
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
