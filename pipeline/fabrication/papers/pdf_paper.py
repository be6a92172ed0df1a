"""Draws on pages of paper in millimetres, from the lower left corner, with head and foot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Literal

import numpy as np

from sim.core import Floats

if TYPE_CHECKING:
    from reportlab.pdfgen.canvas import Canvas

Box = tuple[float, float, float, float]
"""Left, bottom, width, height."""

Paper = Literal["A4", "Letter"]
SIZES: dict[Paper, tuple[float, float]] = {"A4": (210.0, 297.0), "Letter": (215.9, 279.4)}

MARGIN = 10.0
HEAD, FOOT = 12.0, 14.0
BAR = 100.0
"""Length of the check bar on each page, mm."""

POINT = 72.0 / 25.4
INK, GREY, PALE, SIGNAL = "#1a1a1a", "#6b6f75", "#eceef0", "#6f3fa0"
PLAIN, BOLD = "Helvetica", "Helvetica-Bold"


class PdfDocument:
    """Draws the pages of one document, one after the other, with its title at their heads."""

    def __init__(self, canvas: Canvas, paper: Paper, title: str) -> None:
        self.canvas = canvas
        self.width, self.height = SIZES[paper]
        self._title = title
        self._number = 0

    @property
    def room(self) -> Box:
        """The box that head, foot and margins leave."""
        return room(self.width, self.height)

    @contextmanager
    def page(self, heading: str) -> Iterator[None]:
        """Opens a page with head, page number and check bar."""
        self._number += 1
        right, top = self.width - MARGIN, self.height - MARGIN - 4.5
        self.text(MARGIN, top, f"{self._title} - {heading}", 10, BOLD)
        self.text(right, top, f"{self._number}", 10, at="right")
        self._check_bar()
        yield
        self.canvas.showPage()

    def _check_bar(self) -> None:
        """Draws a black bar of 100 mm: the page is to scale if a ruler says so too."""
        self.canvas.setFillColor(INK)
        self.canvas.rect(MARGIN * POINT, MARGIN * POINT, BAR * POINT, 2 * POINT, stroke=0, fill=1)
        words = f"{BAR:g} mm: measure this bar. Print at 100 %, without fitting to the page."
        self.text(MARGIN, MARGIN + 3.5, words, 7, colour=GREY)

    def text(
        self,
        x: float,
        y: float,
        words: str,
        size: float = 8,
        font: str = PLAIN,
        colour: str = INK,
        at: Literal["left", "middle", "right"] = "left",
    ) -> None:
        """Writes words on a line whose base is at y; sizes of type in points."""
        self.canvas.setFont(font, size)
        self.canvas.setFillColor(colour)
        put = {
            "left": self.canvas.drawString,
            "middle": self.canvas.drawCentredString,
            "right": self.canvas.drawRightString,
        }
        put[at](x * POINT, y * POINT, words)

    def line(self, points: Floats, width: float = 0.2, colour: str = INK) -> None:
        """Draws an open polyline (n, 2), its width in mm."""
        self._pen(width, colour)
        self.canvas.drawPath(self._path(points), stroke=1, fill=0)

    def polygon(self, points: Floats, fill: str = "#ffffff", width: float = 0.15) -> None:
        """Draws a closed polygon (n, 2), outlined in ink if the line has a width."""
        self._pen(width, INK)
        self.canvas.setFillColor(fill)
        path = self._path(points)
        path.close()
        self.canvas.drawPath(path, stroke=int(width > 0.0), fill=1)

    def dashed(self, points: Floats, colour: str = GREY) -> None:
        """Draws a thin dashed line."""
        self.canvas.setDash(2 * POINT, 1.5 * POINT)
        self.line(points, 0.15, colour)
        self.canvas.setDash()

    @contextmanager
    def window(self, box: Box) -> Iterator[None]:
        """Clips the drawing to a box."""
        self.canvas.saveState()
        path = self.canvas.beginPath()
        path.rect(*(length * POINT for length in box))
        self.canvas.clipPath(path, stroke=0, fill=0)
        yield
        self.canvas.restoreState()

    def _pen(self, width: float, colour: str) -> None:
        self.canvas.setLineWidth(width * POINT)
        self.canvas.setStrokeColor(colour)

    def _path(self, points: Floats | Sequence[Floats]):  # type: ignore[no-untyped-def]  # noqa: ANN202
        path = self.canvas.beginPath()
        scaled = np.asarray(points) * POINT
        path.moveTo(*scaled[0])
        for point in scaled[1:]:
            path.lineTo(*point)
        return path


def room(width: float, height: float) -> Box:
    """Measures the box that head, foot and margins leave of a page."""
    low = MARGIN + FOOT
    return MARGIN, low, width - 2 * MARGIN, height - MARGIN - HEAD - low
