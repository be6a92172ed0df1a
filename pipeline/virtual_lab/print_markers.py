"""Prints sheets of marks for the tracking, at true size, to stick on the units."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline import datasets
from pipeline.fabrication.parts import labels
from pipeline.problem.sections import Markers, Speckle, UnitAppearance
from pipeline.runtime import UserError, cli, write_atomically
from pipeline.tracking.geometry import as_built, outlines_of_design
from pipeline.virtual_lab import stickers
from pipeline.virtual_lab.face_marks import draw_marks

if TYPE_CHECKING:
    from pipeline.problem.sections import UnitAppearance

LOG = logging.getLogger(__name__)


def parser() -> argparse.ArgumentParser:
    """Makes the stage's command line."""
    made = cli.parser("pipeline.virtual_lab.print_markers", str(__doc__), study=False)
    made.add_argument("--design", type=Path, required=True, metavar="NC", help="the design")
    made.add_argument("--structure", choices=("intact", "altered", "cloaked"), default="cloaked")
    made.add_argument("--out", type=Path, required=True, metavar="PDF", help="the sheets")
    made.add_argument("--kind", choices=("dots", "speckle"), default="dots")
    made.add_argument("--count", type=int, choices=(1, 2, 3), default=3, help="dots per unit (3)")
    made.add_argument("--diameter", type=float, metavar="MM", help="of a dot (2) or speckle (1.2)")
    made.add_argument("--spread", type=float, default=7.0, metavar="MM", help="of the dots (7)")
    made.add_argument("--faces", choices=("dark", "light"), default="dark", help="under the marks")
    made.add_argument("--paper", choices=("A4", "Letter"), default="A4")
    return made


def work(args: argparse.Namespace) -> None:
    """Writes the sheets.

    Raises:
        UserError: sizes that make no sense, or a unit larger than a page.
    """
    design = datasets.read(args.design, "design")
    specimen = outlines_of_design(as_built(design, args.structure))
    found = draw_marks(specimen, args.kind, _look(args), 0)
    index = design[["i", "j"]].sel(unit=specimen.ids)
    names = labels(zip(index["i"].values, index["j"].values, strict=True))
    title = f"{args.out.stem}, {args.structure}"
    with write_atomically(args.out) as aside:
        pages = stickers.write(aside, specimen, found, names, title, args.faces, args.paper)
    bare = specimen.count - len(set(found.unit.tolist()))
    LOG.info("%s: %d faces on %d pages, %d without a mark", args.out, specimen.count, pages, bare)


def _look(args: argparse.Namespace) -> UnitAppearance:

    diameter = args.diameter or (2.0 if args.kind == "dots" else 1.2)
    if not (0.3 <= diameter <= 10.0 and 0.0 < args.spread < 100.0):
        remedy = "give a diameter from 0.3 mm to 10 mm and a positive spread"
        raise UserError("marks of such a size cannot be printed", value=diameter, remedy=remedy)
    dots = Markers.model_construct(
        kind="dots", count=args.count, spread=args.spread, diameter=diameter, depth=0.4
    )
    return UnitAppearance(
        dots=dots, speckle=Speckle.model_construct(diameter=diameter, density=0.35)
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command line."""
    return cli.run(work, parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
