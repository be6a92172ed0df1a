"""Lays out the assembly sheet: order of work, shim list, plan at 1:1, which shim goes where."""

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path

from pipeline.fabrication.papers.assembly_plan import TONES, WORST, AssemblyPlan, Tile, tiles
from pipeline.fabrication.papers.joint_stiffness import stiffness_words
from pipeline.fabrication.papers.pdf_paper import BOLD, GREY, INK, POINT, SIGNAL, PdfDocument
from pipeline.fabrication.parts import SHIM_PLAY, BuiltSpecimen
from pipeline.problem.sections import Fabrication

_LINE = 4.4  # mm from one line of a table to the next
_ROW = 3.4
_LETTERS = 104  # of the steps in a line


def write_assembly_sheet(path: Path, specimen: BuiltSpecimen, settings: Fabrication) -> None:
    """Writes the assembly sheet of a specimen as PDF; the same specimen gives the same bytes."""
    from reportlab.pdfgen.canvas import Canvas

    canvas = Canvas(str(path), invariant=1, pageCompression=1)
    title = f"{specimen.study}, {specimen.structure}"
    canvas.setTitle(f"Assembly of {title}")
    canvas.setAuthor("metacloak")
    sheet = PdfDocument(canvas, settings.paper, title)
    canvas.setPageSize((sheet.width * POINT, sheet.height * POINT))
    plan = AssemblyPlan(specimen, sheet)
    pages = tiles(plan.box, sheet.room[2:])
    _front_page(sheet, plan, assembly_steps(specimen, settings, pages), pages)
    _shim_pages(sheet, specimen)
    for tile in pages:
        _plan_page(sheet, plan, tile)
    _ligament_pages(sheet, specimen)
    _bent_pages(sheet, specimen)
    canvas.save()


def _front_page(
    sheet: PdfDocument, plan: AssemblyPlan, steps: Sequence[str], pages: Sequence[Tile]
) -> None:
    """Draws the order of assembly, and below it the whole plan and its pages in small."""
    left, low, width, height = sheet.room
    with sheet.page("order of assembly"):
        y = low + height - 3.0
        for number, step in enumerate(steps, 1):
            for k, words in enumerate(textwrap.wrap(step, _LETTERS)):
                if k == 0:
                    sheet.text(left, y, f"{number}.", 9, BOLD, SIGNAL)
                sheet.text(left + 7, y, words, 9)
                y -= _LINE
            y -= 1.2
        height = y - low - 6.0
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
    """Lists all kinds of shims: number on the plan, id, length, pieces."""
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
    title = f"shims: {total} pieces of {len(rows)} length{'s' * (len(rows) != 1)}"
    tones = [TONES[number % len(TONES)] for number in range(len(rows))]
    _table(sheet, title, heading, rows, (16, 32, 24, 24, 18, 18, 18), tones)


def _ligament_pages(sheet: PdfDocument, specimen: BuiltSpecimen) -> None:
    """Lists the units that are joined by another shim than the commonest one."""
    common = max(specimen.shims, key=lambda shim: len(shim.ligaments))
    kinds = {
        ligament: (str(number), shim.id)
        for number, shim in enumerate(specimen.shims, 1)
        for ligament in shim.ligaments
        if shim is not common
    }
    rows = [
        (" - ".join(ligament.labels), *kinds[ligament.number])
        for ligament in specimen.ligaments
        if ligament.number in kinds
    ]
    if rows:
        title = f"units that are not joined by shim {common.id}"
        _table(sheet, title, ("units", "on plan", "id"), rows, (26, 16, 18))


def _bent_pages(sheet: PdfDocument, specimen: BuiltSpecimen) -> None:
    """Lists the shims that are bent before any load, the worst first; these are marked."""
    rows = [
        (
            f"worst {rank}" if rank <= WORST else "",
            ligament.name,
            " / ".join(f"{math.degrees(angle):.0f}" for angle in ligament.angles),
            f"{100 * ligament.strain:.1f} %",
            f"{ligament.moment:.1f} N mm",
        )
        for rank, ligament in enumerate(specimen.bent, 1)
    ]
    if rows:
        title = f"{len(rows)} of {len(specimen.ligaments)} shims are bent before any load"
        heading = ("", "units", "ends, deg", "strain", "moment")
        tones = [SIGNAL if row[0] else INK for row in rows]
        _table(sheet, title, heading, rows, (14, 22, 18, 14, 22), tones)


def _table(
    sheet: PdfDocument,
    title: str,
    heading: Sequence[str],
    rows: Sequence[Sequence[str]],
    widths: Sequence[float],
    tones: Sequence[str] = (),
) -> None:
    """Draws a table in as many columns as a page has room for, on as many pages as it takes."""
    left, low, width, height = sheet.room
    side_by_side = max(1, int((width + 4) // (sum(widths) + 4)))
    deep = int((height - 2 * _LINE) // _ROW)
    for start in range(0, max(len(rows), 1), side_by_side * deep):
        with sheet.page(title):
            shown = rows[start : start + side_by_side * deep]
            per_column = -(-len(shown) // side_by_side) if start else min(deep, len(shown))
            for column in range(side_by_side):
                part = range(column * per_column, min((column + 1) * per_column, len(shown)))
                x = left + column * (sum(widths) + 4)
                y = low + height - 3.0
                if part:
                    _cells(sheet, x, y, heading, widths, GREY)
                for k, row in enumerate(part):
                    tone = tones[start + row] if tones else INK
                    _cells(sheet, x, y - _LINE - k * _ROW, shown[row], widths, tone)


def _cells(
    sheet: PdfDocument,
    x: float,
    y: float,
    words: Sequence[str],
    widths: Sequence[float],
    colour: str,
) -> None:
    for word, width in zip(words, widths, strict=True):
        sheet.text(x, y, word, 7.5, colour=colour)
        x += width


def assembly_steps(
    specimen: BuiltSpecimen, settings: Fabrication, pages: Sequence[Tile]
) -> list[str]:
    """Writes the order of assembly, one step an entry, in words that fit the specimen."""
    first, last = specimen.units[0].label, specimen.units[-1].label
    pieces = sum(len(shim.ligaments) for shim in specimen.shims)
    joining = "The plan fits on one page; fix it to the table."
    if len(pages) > 1:
        joining = (
            f"Join the {len(pages)} pages of the plan: cut one of two neighbours along the dashed "
            "line, lay it on the other so that the crosses coincide, and glue."
        )
    pairs = ", ".join(f"{letter} is {label}" for label, letter in specimen.letters.items())
    letters = f" Units too small for their id carry a single letter: {pairs}." if pairs else ""
    laid = ", row by row from the bottom left" if specimen.in_rows else ""
    pushed = ", column by column and then row by row" if specimen.in_rows else ""
    steps = [
        "Measure the bar at the foot of each page: 100 mm, or the print is not to scale.",
        joining,
        "Tolerances: vertices within 0.1 mm of the plan, slots "
        f"{settings.slot_width:.2f} mm wide within 0.05 mm, shims no longer than listed and at "
        "most 0.1 mm shorter.",
        f"Sort {len(specimen.units)} units by their ids, {first} to {last}: {_id_words(specimen)}. "
        "The id is on the "
        "underside of a printed unit and on top of a cut one; the arrow beside it points to the "
        f"top of the plan, as does a ring at the upper end.{letters}",
        _route_step(settings),
        *_kerf_step(settings),
        "Lines of the drawings in laser/, in this order: green engraves, red scores, blue cuts "
        "holes, then black cuts out (white on a dark screen). Grey, on the layer REFERENCE, is the "
        "rim of the sheet: switch grey off.",
        *_layers_step(specimen, settings),
        f"{_foil_words(settings)} Sort {pieces} shims and the spares by their length (next pages); "
        "on the sheet the first of each length tells it in mm and is a spare. Numbers and colours "
        "on the plan are those of the list. A shim is as wide as a unit is high.",
        f"Try a shim in the coupon first: the slots are made {settings.slot_width:.2f} mm wide for "
        f"a foil of {settings.shims.thickness:g} mm. If it is loose or stuck, change "
        "fabrication.slots.clearance and make the package again.",
        "Lay the plan, or the jig, on a flat table and put the units in their places with their "
        f"ids and arrows as on the plan{laid}.",
        f"Push the shims in from above{pushed}, until they stand level with the units. Each "
        f"must reach the inner end of both slots within {SHIM_PLAY:g} mm.",
        *_bent_step(specimen),
        "Check the gaps with the comb, whose teeth are as wide as most of them, then glue (if at "
        "all) from the underside only.",
    ]
    if specimen.clamped:
        clamped = ", ".join(specimen.clamped)
        steps.append(f"Set the clamped units into their pads, grips or adapters: {clamped}.")
    if specimen.driven:
        room = "Where neighbours leave an adapter no room for fingers, glue it on."
        groups = [", ".join(group) for group in specimen.drive_groups]
        if len(groups) == 1:
            steps.append(f"Fix the adapter or the grip of the drive to: {groups[0]}. {room}")
        else:
            listed = "; ".join(f"drive {n} to {labels}" for n, labels in enumerate(groups, 1))
            steps.append(
                "Fix the adapters or the grips of the drives, which move apart from one another: "
                f"{listed}. {room}"
            )
    if specimen.free_words:
        steps.append(
            f"The study leaves free {specimen.free_words}; pads, grips and adapters hold these "
            "units in every way. Let them slide or turn in guides of your own instead, or the "
            "specimen is another structure than was simulated."
        )
    if words := stiffness_words(specimen):
        steps.append(
            f"The study simulates joints stiffer or softer than their shims ({words}). Make them "
            "so, a stiffer one by gluing or screwing its units together, or the specimen is "
            "another structure than was simulated."
        )
    if bare := specimen.without_dots:
        have = "1 unit has" if len(bare) == 1 else f"{len(bare)} units have"
        steps.append(
            f"Dots for the tracking: {have} no room for a dot: {', '.join(bare)}. Nothing marks "
            "these in a film but their own look: paint what fits on them by hand."
        )
    return [*steps, "Lift the specimen out of the jig and move it by hand: no shim may slip."]


def _id_words(specimen: BuiltSpecimen) -> str:
    """Tells what ids count."""
    if specimen.in_rows:
        return "a letter for the column (from the left), a number for the row (from the bottom)"
    return "the letters count in the order of the lattice's file (A to Z, AA, AB and so on)"


def _foil_words(settings: Fabrication) -> str:
    """Tells how the shims leave their sheet."""
    tabs = settings.shims.tabs
    if tabs is None:
        return "Cut the shims; each comes free from the foil."
    return (
        f"Each shim hangs in its sheet by tabs of {tabs.width:g} mm ({tabs.count} a shim): keep "
        "the sheets whole, twist out what the next row takes, and trim what stands out of an edge."
    )


def _route_step(settings: Fabrication) -> str:
    """Writes the step on what is drawn for the printer and for the laser cutter."""
    if settings.laser_cuts_units:
        return "Print the units and the coupon, or cut them: not both. Fixtures are printed."
    return "Print the units and the coupon: no laser cuts their slots."


def _kerf_step(settings: Fabrication) -> list[str]:
    """Writes the step on the two variants of each sheet; none if there is one."""
    if not settings.laser.kerf:
        return []
    kerf, hung = f"{settings.laser.kerf:g}", ""
    if settings.shims.tabs is not None:
        hung = f" Of shims, which hang on tabs, cut those _kerf{kerf} on any cutter."
    if not settings.laser_cuts_units:
        hung += " Those of the units and the coupon are for reference."
    return [
        f"Cut either the drawings _nominal or those _kerf{kerf}, never both: the second ones make "
        f"good a cut {kerf} mm wide, the first are for a cutter that does so itself.{hung}"
    ]


def _layers_step(specimen: BuiltSpecimen, settings: Fabrication) -> list[str]:
    """Writes the step on units that are cut in layers; none if a laser cuts them whole or not."""
    if not settings.laminated:
        return []
    few = [unit.label for unit in specimen.units if len(unit.pins) < 2]
    alone = f" {len(few)} units have room for one pin or none (bill); their pocket aligns them."
    return [
        "Units and coupon by laser: cut their drawings "
        f"{settings.laser_layers} times from sheet of "
        f"{settings.laser_sheet_thickness:.2f} mm, stack the layers of a unit on pins of "
        f"{settings.laser.pin:g} mm in its pocket of the jig, ids up, and glue."
        + (alone if few else "")
    ]


def _bent_step(specimen: BuiltSpecimen) -> list[str]:
    """Writes the step on shims that are bent before any load; none if there are none."""
    bent = specimen.bent
    if not bent:
        return []
    return [
        f"{len(bent)} shims stand in slots at an angle and are bent before any load, to a strain "
        f"of {100 * bent[0].strain:.1f} % at most (last pages). The {min(WORST, len(bent))} worst "
        "have a ring on the plan: bend them over a rod first, or they crease or push their units."
    ]
