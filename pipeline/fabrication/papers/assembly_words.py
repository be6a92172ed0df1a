"""What the assembly sheet says: the order of work, in words that fit this specimen."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from pipeline.fabrication.papers.page_tiles import Tile
from pipeline.fabrication.parts import BuiltSpecimen
from pipeline.problem.sections import Fabrication


def steps(specimen: BuiltSpecimen, asked: Fabrication, pages: Sequence[Tile]) -> list[str]:
    """The order of assembly, one step an entry."""
    first, last = specimen.units[0].label, specimen.units[-1].label
    pieces = sum(len(shim.ligaments) for shim in specimen.shims)
    told = [
        "Measure the bar at the foot of each page: 100 mm, or the print is not to scale.",
        _joining(pages),
        f"Sort {len(specimen.units)} units by their ids, {first} to {last}: a letter for the "
        "column (from the left), a number for the row (from the bottom). The id is on the "
        "underside of a printed unit and on top of a cut one; the arrow beside it points to the "
        f"top of the plan, as does a ring at the upper end.{_letters(specimen)}",
        f"Cut and sort {pieces} shims and the spares by their length (next pages); on the sheet "
        "the first of each length tells it in mm and is a spare. Numbers and colours on the plan "
        "are those of the list. A shim is as wide as a unit is high.",
        f"Try a shim in the coupon first: the slots are made {asked.slot_width:.2f} mm wide for a "
        f"foil of {asked.shims.thickness:g} mm. If it is loose or stuck, change "
        "fabrication.slots.clearance and make the package again.",
        "Lay the plan, or the jig, on a flat table and put the units in their places with their "
        "ids and arrows as on the plan, row by row from the bottom left.",
        "Push the shims in from above, column by column and then row by row, until they stand "
        "level with the units. Each must reach the inner end of both slots.",
        "Check every gap with the comb, then glue (if at all) from the underside only.",
    ]
    return told + _fixing(specimen)


def _letters(specimen: BuiltSpecimen) -> str:
    """What units carry that are too small for their ids."""
    if not specimen.letters:
        return ""
    pairs = ", ".join(f"{letter} is {label}" for label, letter in specimen.letters.items())
    return f" Units too small for their id carry a single letter: {pairs}."


def _joining(pages: Sequence[Tile]) -> str:
    if len(pages) == 1:
        return "The plan fits on one page; fix it to the table."
    return (
        f"Join the {len(pages)} pages of the plan: cut one of two neighbours along the dashed "
        "line, lay it on the other so that the crosses coincide, and glue."
    )


def _fixing(specimen: BuiltSpecimen) -> list[str]:
    """The last steps: into the fixtures (tinted on the plan), out of the jig."""
    told = []
    if specimen.clamped:
        clamped = ", ".join(specimen.clamped)
        told.append(f"Set the clamped units into their pads or grips: {clamped}.")
    if specimen.driven:
        driven = ", ".join(specimen.driven)
        room = "Where neighbours leave an adapter no room for fingers, glue it on."
        told.append(f"Fix the adapter or the grip of the drive to: {driven}. {room}")
    return [*told, "Lift the specimen out of the jig and move it by hand: no shim may slip."]


def paragraphs(text: str, width: int) -> list[str]:
    """Lines of at most `width` letters."""
    return textwrap.wrap(text, width)
