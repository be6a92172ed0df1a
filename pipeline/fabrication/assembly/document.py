"""The pages of the assembly sheet: order of work, shim list, plan at 1:1, which shim goes where."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pipeline.fabrication.assembly.paper import (
    BOLD,
    GREY,
    INK,
    PALE,
    POINT,
    SIGNAL,
    Paper,
    Sheet,
)
from pipeline.fabrication.assembly.plan import Plan, legend
from pipeline.fabrication.assembly.tiles import Tile, tiles
from pipeline.fabrication.assembly.words import paragraphs, steps
from pipeline.fabrication.parts import Specimen
from pipeline.problem.fabrication import Fabrication

_LINE = 4.4  # mm from one line of a table to the next
_ROW = 3.4


def write(path: Path, specimen: Specimen, asked: Fabrication, paper: Paper = "A4") -> None:
    """Write the assembly sheet of a specimen; the same specimen gives the same bytes.

    Args:
        path: the PDF to write.
        specimen: what is built.
        asked: the parameters of fabrication.
        paper: size of the pages.
    """
    from reportlab.pdfgen.canvas import Canvas

    canvas = Canvas(str(path), invariant=1, pageCompression=1)
    title = f"{specimen.study}, {specimen.structure}"
    canvas.setTitle(f"Assembly of {title}")
    canvas.setAuthor("metacloak")
    sheet = Sheet(canvas, paper, title)
    canvas.setPageSize((sheet.width * POINT, sheet.height * POINT))
    plan = Plan(specimen, sheet)
    pages = tiles(plan.box, sheet.room[2:])
    _front(sheet, specimen, asked, pages)
    for tile in pages:
        _plan_page(sheet, plan, tile)
    _ligament_pages(sheet, specimen)
    canvas.save()


def _front(sheet: Sheet, specimen: Specimen, asked: Fabrication, pages: Sequence[Tile]) -> None:
    """Order of assembly and the first lines of the shim list; more pages if it is long."""
    left, low, width, height = sheet.room
    with sheet.page("order of assembly"):
        y = low + height - 3.0
        for number, told in enumerate(steps(specimen, asked, pages), 1):
            for k, words in enumerate(paragraphs(told, 104)):
                if k == 0:
                    sheet.text(left, y, f"{number}.", 9, BOLD, SIGNAL)
                sheet.text(left + 7, y, words, 9)
                y -= _LINE
            y -= 1.2
        _pages_sketch(sheet, pages, (left, low, width, y - low - 4.0))
    _shim_pages(sheet, specimen)


def _pages_sketch(
    sheet: Sheet, pages: Sequence[Tile], room: tuple[float, float, float, float]
) -> None:
    """How the pages of the plan lie beside each other."""
    import numpy as np

    rows, columns = pages[0].of
    _, _, wide, tall = pages[0].window
    scale = min(90.0 / (columns * wide), (room[3] - 8.0) / (rows * tall), 0.3)
    top = room[1] + room[3]
    sheet.text(room[0], top, "The pages of the plan, as they are joined", 9, BOLD)
    for tile in pages:
        x = room[0] + tile.column * wide * scale
        y = top - 4.0 - (tile.row + 1) * tall * scale
        corners = np.array([[0, 0], [wide, 0], [wide, tall], [0, tall]]) * scale + [x, y]
        sheet.polygon(corners, PALE)
        middle = corners.mean(axis=0)
        sheet.text(middle[0], middle[1] - 1.5, tile.name, 11, BOLD, at="middle")


def _plan_page(sheet: Sheet, plan: Plan, tile: Tile) -> None:
    left, low, width, height = sheet.room
    _, _, wide, tall = tile.window
    rows, columns = tile.of
    with sheet.page(f"plan {tile.name} of {rows} x {columns}, 1:1, seen from the top"):
        plan.draw(tile, (left + (width - wide) / 2, low + (height - tall) / 2, wide, tall))


def _shim_pages(sheet: Sheet, specimen: Specimen) -> None:
    """All kinds of shims: number on the plan, id, length, pieces."""
    tones = {name: tone for _, name, tone in legend(specimen.shims)}
    rows = [
        (
            str(number),
            shim.id,
            f"{shim.length:.2f} mm",
            f"{shim.width:.2f} mm",
            str(len(shim.ligaments)),
            str(shim.spares),
            str(shim.count),
        )
        for number, shim in enumerate(specimen.shims, 1)
    ]
    heading = ("on plan", "id", "length", "width", "needed", "spare", "to cut")
    total = sum(shim.count for shim in specimen.shims)
    title = f"shims: {total} pieces of {len(rows)} lengths"
    _table(sheet, title, heading, rows, (16, 32, 24, 24, 18, 18, 18), [tones[r[1]] for r in rows])


def _ligament_pages(sheet: Sheet, specimen: Specimen) -> None:
    """Which shim joins which units, unless there is but one kind of shim."""
    if len(specimen.shims) == 1:
        return
    kinds = {
        ligament: (number, shim.id)
        for number, shim in enumerate(specimen.shims, 1)
        for ligament in shim.ligaments
    }
    rows = [
        (" - ".join(ligament.labels), str(kinds[ligament.number][0]), kinds[ligament.number][1])
        for ligament in specimen.ligaments
    ]
    _table(sheet, "which shim joins which units", ("units", "on plan", "id"), rows, (26, 16, 18))


def _table(
    sheet: Sheet,
    title: str,
    heading: Sequence[str],
    rows: Sequence[Sequence[str]],
    widths: Sequence[float],
    tones: Sequence[str] = (),
) -> None:
    """A table in as many columns as the page has room for, on as many pages as it takes."""
    left, low, width, height = sheet.room
    beside = max(1, int((width + 4) // (sum(widths) + 4)))
    deep = int((height - 2 * _LINE) // _ROW)
    for start in range(0, max(len(rows), 1), beside * deep):
        with sheet.page(title):
            shown = rows[start : start + beside * deep]
            per_column = -(-len(shown) // beside) if start else min(deep, len(shown))
            for column in range(beside):
                part = range(column * per_column, min((column + 1) * per_column, len(shown)))
                x = left + column * (sum(widths) + 4)
                y = low + height - 3.0
                if part:
                    _cells(sheet, x, y, heading, widths, 7.5, GREY)
                for k, row in enumerate(part):
                    tone = tones[start + row] if tones else INK
                    _cells(sheet, x, y - _LINE - k * _ROW, shown[row], widths, 7.5, tone)


def _cells(
    sheet: Sheet,
    x: float,
    y: float,
    words: Sequence[str],
    widths: Sequence[float],
    size: float,
    colour: str,
) -> None:
    for word, width in zip(words, widths, strict=True):
        sheet.text(x, y, word, size, colour=colour)
        x += width
