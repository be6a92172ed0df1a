"""Writes and reads the bill of materials, a CSV: units, shims, sheets, plates, their masses."""

import csv
import io
import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from pathlib import Path

from shapely import LineString

from pipeline.fabrication.fixtures import coupon, shim_pieces, strip_parts
from pipeline.fabrication.papers.joint_stiffness import factor_words
from pipeline.fabrication.parts import (
    STRAIGHT,
    THIN_WALL,
    BuiltSpecimen,
    FlatPart,
    Ligament,
    Shim,
    Unit,
)
from pipeline.fabrication.plates import STRAND, PrintEstimate
from pipeline.fabrication.readback import unreadable
from pipeline.problem.sections import Fabrication

BILL = "bom.csv"
"""Name of the file in a package."""

FOIL = 1.38e-9
"""Density of polyester foil, tonne/mm^3."""

_GRAMS = 1e6  # in a tonne
_FEED, _START = 10.0, 0.5  # mm/s of a laser through foil, s until a cut begins; assumed
_HEADING = "item id count area_mm2 volume_mm3 mass_g length_mm width_mm height_mm files note"
_LAYERED = ("laser/units_", "laser/coupon_")
"""Begin the names of the sheets that are cut once for each layer of a unit."""
DRAWN_TWICE = (*_LAYERED, "print/units_", "print/coupon_")
"""Begin the names of the files of what is drawn for the laser cutter and for the printer."""
_EITHER = "print units and coupon or cut them, not both"
_KINDS = {"laser": "sheet", "print": "plate", "fixture": "fixture"}  # of files, by their folder


@dataclass(frozen=True)
class BillRow:
    """Holds one line of the bill. Lengths in mm, areas in mm^2, volumes in mm^3, masses in g."""

    item: str  # unit, shim, ligament, pin, dot, sheet, plate, fixture, foil (ways to it), total
    id: str  # of the part, number of a ligament, or path of the file in the package
    count: int
    area: float | None = None  # of one piece, as all that follows
    volume: float | None = None  # as if it were solid
    mass: float | None = None  # at the problem's areal density (units) or solid (shims)
    length: float | None = None
    width: float | None = None
    height: float | None = None
    files: str = ""  # that hold it
    note: str = ""  # anything else, in words


def write_bill(path: Path, rows: Iterable[BillRow]) -> None:
    """Writes the bill of materials."""
    stream = io.StringIO()
    table = csv.writer(stream, lineterminator="\n")
    table.writerow(_HEADING.split())
    for row in rows:
        table.writerow(f"{v:.4f}" if isinstance(v, float) else v for v in astuple(row))
    path.write_text(stream.getvalue(), encoding="utf-8", newline="\n")


def read_bill(path: Path) -> list[dict[str, str]]:
    """Reads the lines of a bill of materials, cells by the names of their columns.

    Raises:
        UserError: it cannot be read.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file, strict=True))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise unreadable("the bill of materials", path, error) from error


def bill_rows(
    specimen: BuiltSpecimen,
    settings: Fabrication,
    density: float,
    contents: Mapping[str, Sequence[str]],
    prints: Mapping[str, PrintEstimate],
    infill: float,
) -> Iterator[BillRow]:
    """Yields rows: each unit, kind of shim, ligament, file to cut or print, the totals.

    Args:
        specimen: to be built.
        settings: of the fabrication.
        density: areal density of the units, tonne/mm^2.
        contents: ids of the parts in each sheet, plate and fixture, by its path in the package.
        prints: what the printed ones of them take.
        infill: share of their inside that is filled.
    """
    holders: dict[str, list[str]] = {}
    for file, parts in contents.items():
        for part in dict.fromkeys(parts):
            holders.setdefault(part, []).append(file)
    units = [_unit(unit, density, holders, in_rows=specimen.in_rows) for unit in specimen.units]
    shims = [_shim(shim, settings, holders) for shim in specimen.shims]
    yield from units
    yield from shims
    kinds = {number: shim.id for shim in specimen.shims for number in shim.ligaments}
    for ligament in specimen.ligaments:
        factors = specimen.stiffness.get(ligament.number)
        yield _ligament(ligament, kinds[ligament.number], factors)
    for file, parts in contents.items():
        yield _file(file, len(parts), settings, prints.get(file))
    if settings.laminated:
        yield _pins(specimen, settings)
    yield _dots(specimen)
    yield from _foil(specimen, settings, contents)
    mass, volume = _sum(units, "mass"), _sum(units, "volume")
    labels = {unit.id for unit in units}
    plates = [prints[file] for file in prints if labels.issuperset(contents[file])]
    note = _mass_words(mass, volume, _total(plates), settings, infill)
    yield BillRow("total", "units", len(units), volume=volume, mass=mass, note=note)
    mass, volume = _sum(shims, "mass"), _sum(shims, "volume")
    count = sum(row.count for row in shims)
    yield BillRow("total", "shims", count, volume=volume, mass=mass, note="polyester")
    whole = _total(prints.values())
    volume, mass = whole.filament * STRAND, _grams(whole, settings)
    note = _print_words(whole, settings)
    yield BillRow("total", "prints", len(prints), volume=volume, mass=mass, note=note)


def _unit(
    unit: Unit, density: float, holders: Mapping[str, Sequence[str]], *, in_rows: bool
) -> BillRow:
    """Describes a unit; notes the depths of its slots, by vertex, and the thinnest wall."""
    width, height = unit.part.size
    place = f"column {unit.column + 1} row {unit.row + 1}"
    note = place if in_rows else f"number {unit.column + 1} in the lattice's file"
    if unit.letter:
        note += f"; carries {unit.letter} for its id"
    if unit.slots:
        slots = sorted(unit.slots, key=lambda slot: slot.vertex)
        warning = " (thin)" if unit.wall < THIN_WALL else ""
        note += f"; slots {' '.join(f'{slot.depth:g}' for slot in slots)} mm deep"
        note += f"; walls from {unit.wall:.2f} mm{warning}"
    return BillRow(
        "unit",
        unit.label,
        1,
        area=unit.outline.area,
        volume=unit.outline.area * unit.height,
        mass=unit.design.area * density * _GRAMS,
        length=width,
        width=height,
        height=unit.height,
        files=" ".join(holders.get(unit.label, ())),
        note=note,
    )


def _file(file: str, parts: int, settings: Fabrication, printing: PrintEstimate | None) -> BillRow:
    """Describes a sheet, a plate or a fixture; notes what it is cut or printed in the place of."""
    note, count = _counted(parts, "part"), 1
    folder, _, name = file.partition("/")
    if folder == "laser" and settings.kerf_of(name.partition("_")[0]):
        note += f"; {_variant_words(file, settings)}"
    if file.startswith(_LAYERED):
        note += f"; {settings.laser_route}"
        count = settings.laser_layers if settings.laminated else 1
    if file.startswith(DRAWN_TWICE) and settings.laser_cuts_units:
        note += f"; {_EITHER}"
    if printing is not None:
        note += f"; {_print_words(printing, settings)}"
    return BillRow(_KINDS[folder], file, count, note=note)


def _shim(shim: Shim, settings: Fabrication, holders: Mapping[str, Sequence[str]]) -> BillRow:
    area, thickness = shim.length * shim.width, settings.shims.thickness
    return BillRow(
        "shim",
        shim.id,
        shim.count,
        area=area,
        volume=area * thickness,
        mass=area * thickness * FOIL * _GRAMS,
        length=shim.length,
        width=shim.width,
        height=thickness,
        files=" ".join(holders.get(shim.id, ())),
        note=f"{_counted(len(shim.ligaments), 'ligament')}, {_counted(shim.spares, 'spare')}",
    )


def _ligament(ligament: Ligament, shim: str, factors: Sequence[float] | None) -> BillRow:
    """Describes a ligament; notes how its shim is bent, and how much stiffer it is to be."""
    note = f"{ligament.name}; shim {shim}; {prebend_words(ligament)}; free {ligament.free:.2f} mm"
    if factors is not None:
        note += f"; {factor_words(factors)} in the study"
    return BillRow("ligament", str(ligament.number), 1, length=ligament.length, note=note)


def prebend_words(ligament: Ligament) -> str:
    """Tells how a shim is bent before any load."""
    if ligament.strain <= STRAIGHT:
        return "straight"
    ends = " and ".join(f"{math.degrees(angle):.1f}" for angle in ligament.angles)
    return (
        f"ends turned {ends} deg; strain {100 * ligament.strain:.2f} %,"
        f" moment {ligament.moment:.2f} N mm before any load"
    )


def _pins(specimen: BuiltSpecimen, settings: Fabrication) -> BillRow:
    """Describes the pins that align layers; names the units that have room for less than two."""
    counts = {unit.label: len(unit.pins) for unit in specimen.units}
    note = f"aligns {settings.laser_layers} layers"
    for count, words in ((1, "one pin only"), (0, "no room for a pin: the jig alone aligns")):
        if few := [label for label, pins in counts.items() if pins == count]:
            note += f"; {words}: {', '.join(few)}"
    tried = len(coupon(settings, layered=True).holes)
    note += f"; {tried} for the coupon; {_EITHER}"
    pin, total = settings.laser.pin, sum(counts.values()) + tried
    return BillRow(
        "pin", f"PIN{pin:g}", total, length=settings.thickness, width=pin, height=pin, note=note
    )


def _dots(specimen: BuiltSpecimen) -> BillRow:
    """Counts the dots for the tracking."""
    count = sum(len(unit.markers) for unit in specimen.units)
    note = "to be marked through the holes of the template"
    if bare := specimen.without_dots:
        note += f"; no room for one on {_counted(len(bare), 'unit')}: {', '.join(bare)}"
    return BillRow("dot", "dots", count, note=note)


def _foil(
    specimen: BuiltSpecimen, settings: Fabrication, contents: Mapping[str, Sequence[str]]
) -> Iterator[BillRow]:
    """Describes the ways to handle shims: parts, and the cuts that they take."""
    tabs = settings.shims.tabs
    pieces = shim_pieces(specimen, settings)
    free = [replace(piece, tabs=()) for piece in pieces]
    sheets = [file for file in contents if file.startswith("laser/shims_") and "nominal" in file]
    yield _foil_row("free pieces", len(free), free, drawn=tabs is None)
    if tabs is not None:
        yield _foil_row("sheets of pieces on tabs", len(sheets), pieces, drawn=True)
    if specimen.in_rows:
        joined = strip_parts(specimen, settings)
        yield _foil_row("strips, one a row and a column", len(joined), joined, drawn=False)


def _foil_row(name: str, count: int, parts: Sequence[FlatPart], *, drawn: bool) -> BillRow:
    """Tells the cuts and scored lines of foil, and their time on a laser cutter."""
    lines = [line for part in parts for line in (*part.cuts, *part.scores)]
    path = sum(LineString(line).length for line in lines)
    minutes = (path / _FEED + len(lines) * _START) / 60.0
    note = f"{_counted(len(lines), 'cut')} of {path / 1000.0:.2f} m, about {minutes:.1f} min"
    note += "; drawn" if drawn else "; for comparison, not drawn"
    return BillRow("foil", name, count, length=path, note=note)


def _variant_words(file: str, settings: Fabrication) -> str:
    """Tells which sheets a sheet may be cut in the place of."""
    nominal, kerf = "_nominal" in file, settings.laser.kerf
    if file.startswith("laser/shims_") and settings.shims.tabs is not None:
        if not nominal:
            return "kerf made good: cut it, not the nominal sheets"
        what = "do not cut it: its lines, from tab to tab, are open, and no cutter makes its"
        return f"at nominal size: {what} kerf good on these; cut the sheets of kerf{kerf:g}"
    if nominal:
        return f"at nominal size: cut it or the sheets of kerf{kerf:g}, not both"
    return "kerf made good: cut it or the nominal sheets, not both"


def _print_words(found: PrintEstimate, settings: Fabrication) -> str:
    """Tells the time and the filament of a print."""
    hours, minutes = divmod(round(found.seconds / 60.0), 60)
    grams = _grams(found, settings)
    return f"about {hours} h {minutes:02} min, {found.filament / 1000.0:.1f} m or {grams:.0f} g"


def _mass_words(
    mass: float, volume: float, plates: PrintEstimate, settings: Fabrication, infill: float
) -> str:
    """Tells what a mass of the units (g) is, and what they weigh if solid and as printed."""
    solid = volume * settings.solid_density * _GRAMS
    words = f"{settings.material}; at the density that is simulated"
    words += ", more than solid" if mass > solid else ""
    words += f"; {solid:.1f} g if solid"
    if plates.filament:
        printed = _grams(plates, settings)
        words += f", about {printed:.0f} g as printed with walls and {100 * infill:.0f} % infill"
    return words


def _total(prints: Collection[PrintEstimate]) -> PrintEstimate:
    """Adds up the estimates of some plates."""
    return PrintEstimate(sum(p.seconds for p in prints), sum(p.filament for p in prints))


def _grams(found: PrintEstimate, settings: Fabrication) -> float:
    """Computes the mass of a print, g."""
    return found.filament * STRAND * settings.solid_density * _GRAMS


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _sum(rows: Sequence[BillRow], name: str) -> float:
    return float(sum(row.count * getattr(row, name) for row in rows))
