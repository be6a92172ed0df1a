"""The pages of the assembly sheet: order of work, shim list, plan at 1:1, which shim goes where."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pipeline.fabrication.papers.assembly_plan import AssemblyPlan, legend
from pipeline.fabrication.papers.assembly_words import paragraphs, steps
from pipeline.fabrication.papers.page_tiles import Tile, tiles
from pipeline.fabrication.papers.pdf_paper import BOLD, GREY, INK, POINT, SIGNAL, Box, PdfDocument
from pipeline.fabrication.parts import BuiltSpecimen
from pipeline.problem.sections import Fabrication

_LINE = 4.4  # mm from one line of a table to the next
_ROW = 3.4


def write(path: Path, specimen: BuiltSpecimen, asked: Fabrication) -> None:
    """Write the assembly sheet of a specimen; the same specimen gives the same bytes.

    Args:
        path: the PDF to write.
        specimen: what is built.
        asked: the parameters of fabrication.
    """
    from reportlab.pdfgen.canvas import Canvas

    canvas = Canvas(str(path), invariant=1, pageCompression=1)
    title = f"{specimen.study}, {specimen.structure}"
    canvas.setTitle(f"Assembly of {title}")
    canvas.setAuthor("metacloak")
    sheet = PdfDocument(canvas, asked.paper, title)
    canvas.setPageSize((sheet.width * POINT, sheet.height * POINT))
    plan = AssemblyPlan(specimen, sheet)
    pages = tiles(plan.box, sheet.room[2:])
    _front(sheet, plan, steps(specimen, asked, pages), pages)
    _shim_pages(sheet, specimen)
    for tile in pages:
        _plan_page(sheet, plan, tile)
    _ligament_pages(sheet, specimen)
    canvas.save()


def _front(
    sheet: PdfDocument, plan: AssemblyPlan, told: Sequence[str], pages: Sequence[Tile]
) -> None:
    """The order of assembly, and the pages of the plan in small."""
    left, low, width, height = sheet.room
    with sheet.page("order of assembly"):
        y = low + height - 3.0
        for number, step in enumerate(told, 1):
            for k, words in enumerate(paragraphs(step, 104)):
                if k == 0:
                    sheet.text(left, y, f"{number}.", 9, BOLD, SIGNAL)
                sheet.text(left + 7, y, words, 9)
                y -= _LINE
            y -= 1.2
        _sketch(sheet, plan, pages, (left, low, width, y - low - 6.0))


def _sketch(sheet: PdfDocument, plan: AssemblyPlan, pages: Sequence[Tile], room: Box) -> None:
    """The whole plan in small, and how its pages are joined."""
    left, low, width, height = room
    _, _, wide, tall = plan.box
    scale = min(width / wide, (height - 6.0) / tall)
    sheet.text(left, low + height - 2.0, "The plan and its pages", 9, BOLD)
    plan.sketch(pages, (left, low + height - 6.0 - scale * tall), scale)


def _plan_page(sheet: PdfDocument, plan: AssemblyPlan, tile: Tile) -> None:
    left, low, width, height = sheet.room
    _, _, wide, tall = tile.window
    rows, columns = tile.of
    with sheet.page(f"plan {tile.name} of {rows} x {columns}, 1:1, seen from the top"):
        plan.draw(tile, (left + (width - wide) / 2, low + (height - tall) / 2, wide, tall))


def _shim_pages(sheet: PdfDocument, specimen: BuiltSpecimen) -> None:
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


def _ligament_pages(sheet: PdfDocument, specimen: BuiltSpecimen) -> None:
    """Which units are joined by another shim than the commonest one."""
    common = max(specimen.shims, key=lambda shim: len(shim.ligaments))
    kinds = {
        ligament: (number, shim.id)
        for number, shim in enumerate(specimen.shims, 1)
        for ligament in shim.ligaments
        if shim is not common
    }
    rows = [
        (" - ".join(ligament.labels), str(kinds[ligament.number][0]), kinds[ligament.number][1])
        for ligament in specimen.ligaments
        if ligament.number in kinds
    ]
    if rows:
        title = f"units that are not joined by shim {common.id}"
        _table(sheet, title, ("units", "on plan", "id"), rows, (26, 16, 18))


def _table(
    sheet: PdfDocument,
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
    sheet: PdfDocument,
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
