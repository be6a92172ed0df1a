"""Draws faces of the units at true size, to cut out and stick on: dots or speckle, with ids."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np

from pipeline.fabrication.papers import GREY, INK, POINT, Paper, PdfDocument
from pipeline.fabrication.plates import Spot, TooLargeError, pack
from pipeline.runtime import UserError
from pipeline.tracking.geometry import SpecimenOutlines
from pipeline.virtual_lab.face_marks import FaceMarks
from sim.core import Floats

Ink = Literal["dark", "light"]

_GAP = 1.5  # mm between stickers
_LABEL = 3.2  # mm below each for its id
_PAPER = "#ffffff"


def write(
    path: Path,
    specimen: SpecimenOutlines,
    marks: FaceMarks,
    labels: list[str],
    title: str,
    ink: Ink,
    paper: Paper,
) -> int:
    """Writes the sheets; the same specimen gives the same bytes.

    Args:
        path: the PDF.
        specimen: the units.
        marks: what goes on them.
        labels: of the units.
        title: at the head of every page.
        ink: dark faces with light marks, for a bright board, or the other way round.
        paper: size of the pages.

    Returns:
        Number of pages.

    Raises:
        UserError: a unit is larger than a page.
    """
    from reportlab.pdfgen.canvas import Canvas

    canvas = Canvas(str(path), invariant=1, pageCompression=1)
    canvas.setTitle(f"Marker sheets of {title}")
    canvas.setAuthor("metacloak")
    sheet = PdfDocument(canvas, paper, title)
    canvas.setPageSize((sheet.width * POINT, sheet.height * POINT))
    spots = _layout(specimen, sheet, labels)
    pages = 1 + max(place.sheet for place in spots)
    for page in range(pages):
        here = [place for place in spots if place.sheet == page]
        with sheet.page(f"faces to cut out, {page + 1} of {pages}"):
            for place in here:
                _draw_sticker(sheet, specimen, marks, labels, place, ink)
    canvas.save()
    return pages


def _layout(specimen: SpecimenOutlines, sheet: PdfDocument, labels: list[str]) -> list[Spot]:
    _, _, width, height = sheet.room
    sizes = [np.ptp(specimen.polygon(unit), axis=0) for unit in range(specimen.count)]
    boxes = [(float(x), float(y) + _LABEL) for x, y in sizes]
    try:
        return pack(boxes, (width, height), 0.0, _GAP)
    except TooLargeError as error:
        what = "the unit is larger than a page"
        remedy = "print it on larger paper: mark it by hand, or track it bare"
        raise UserError(what, value=labels[error.part], remedy=remedy) from error


def _draw_sticker(
    sheet: PdfDocument,
    specimen: SpecimenOutlines,
    marks: FaceMarks,
    labels: list[str],
    place: Spot,
    ink: Ink,
) -> None:
    outline = specimen.polygon(place.part)
    left, low, _, _ = sheet.room
    origin = np.array([left + place.x, low + place.y + _LABEL]) - outline.min(axis=0)
    face, mark = (INK, _PAPER) if ink == "dark" else (_PAPER, INK)
    sheet.polygon(outline + origin, fill=face)
    _draw_marks(sheet, origin, marks, place.part, mark)
    middle = left + place.x + float(np.ptp(outline[:, 0])) / 2
    sheet.text(middle, low + place.y + 0.6, labels[place.part], 6, colour=GREY, at="middle")


def _draw_marks(
    sheet: PdfDocument, origin: Floats, marks: FaceMarks, unit: int, colour: str
) -> None:
    sheet.canvas.setFillColor(colour)
    draw: Callable[..., None] = sheet.canvas.circle
    for (x, y), diameter in zip(
        marks.centre[marks.unit == unit] + origin, marks.diameter[marks.unit == unit], strict=True
    ):
        draw(x * POINT, y * POINT, diameter / 2 * POINT, stroke=0, fill=1)
