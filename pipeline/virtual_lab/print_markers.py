"""Prints sheets of marks for the tracking, at true size, to stick on the units."""

import argparse
import logging

from pipeline import datasets
from pipeline.fabrication.parts import labels
from pipeline.problem.sections import Markers, Speckle, UnitAppearance
from pipeline.runtime import UserError, write_atomically
from pipeline.tracking.geometry import as_built, outlines_of_design
from pipeline.virtual_lab import stickers
from pipeline.virtual_lab.face_marks import draw_marks

LOG = logging.getLogger(__name__)


def work(args: argparse.Namespace) -> None:
    """Writes the sheets.

    Raises:
        UserError: sizes that make no sense, or a unit larger than a page.
    """
    design = datasets.read(args.design, "design")
    specimen = outlines_of_design(as_built(design, args.structure))
    found = draw_marks(specimen, args.kind, _appearance(args), 0)
    index = design[["i", "j"]].sel(unit=specimen.ids)
    names = labels(zip(index["i"].values, index["j"].values, strict=True))
    title = f"{args.out.stem}, {args.structure}"
    with write_atomically(args.out) as aside:
        pages = stickers.write(aside, specimen, found, names, title, args.faces, args.paper)
    bare = specimen.count - len(set(found.unit.tolist()))
    LOG.info("%s: %d faces on %d pages, %d without a mark", args.out, specimen.count, pages, bare)


def _appearance(args: argparse.Namespace) -> UnitAppearance:
    usual = 2.0 if args.kind == "dots" else 1.2
    diameter = usual if args.diameter is None else args.diameter
    for key, value, fits, remedy in (
        ("--diameter", diameter, 0.3 <= diameter <= 10.0, "give 0.3 mm to 10 mm"),
        (
            "--spread",
            args.spread,
            0.0 < args.spread < 100.0,
            "give more than 0 mm and less than 100 mm",
        ),
    ):
        if not fits:
            what = "marks of such a size cannot be printed"
            raise UserError(what, key=key, value=value, remedy=remedy)
    dots = Markers.model_construct(
        kind="dots", count=args.count, spread=args.spread, diameter=diameter, depth=0.4
    )
    return UnitAppearance(
        dots=dots, speckle=Speckle.model_construct(diameter=diameter, density=0.35)
    )
