"""The bill of materials as CSV: units, shims, sheets, plates, and what they weigh."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from pipeline.fabrication.parts import THIN_WALL, BuiltSpecimen, Shim, Unit
from pipeline.problem.sections import Fabrication

DENSITIES = {
    "PLA": 1.24e-9,
    "PETG": 1.27e-9,
    "ABS": 1.04e-9,
    "ASA": 1.07e-9,
    "PA12": 1.01e-9,
    "PMMA": 1.18e-9,
    "POM": 1.41e-9,
}
"""Of the solid materials, tonne/mm^3 (makers' data sheets)."""

FOIL = 1.38e-9
"""Density of polyester foil, tonne/mm^3."""

_GRAMS = 1e6


@dataclass(frozen=True)
class BillRow:
    """One line of the bill. Lengths in mm, areas in mm^2, volumes in mm^3, masses in g.

    Attributes:
        item: unit, shim, sheet, plate, fixture or total.
        id: of the part, or path of the file in the package.
        count: pieces.
        area, volume: of one piece; the volume as if it were solid.
        mass: of one piece at the problem's areal density (units) or solid (shims).
        length, width, height: of one piece.
        files: files that hold it.
        note: anything else, in words.
    """

    item: str
    id: str
    count: int
    area: float | None = None
    volume: float | None = None
    mass: float | None = None
    length: float | None = None
    width: float | None = None
    height: float | None = None
    files: str = ""
    note: str = ""


_UNITS = {
    "area": "mm2",
    "volume": "mm3",
    "mass": "g",
    "length": "mm",
    "width": "mm",
    "height": "mm",
}


def write(
    path: Path,
    specimen: BuiltSpecimen,
    asked: Fabrication,
    density: float,
    contents: Mapping[str, Sequence[str]],
) -> None:
    """Write the bill of materials of a specimen.

    Args:
        path: the CSV to write.
        specimen: what is built.
        asked: the parameters of fabrication.
        density: areal density of the units, tonne/mm^2.
        contents: ids of the parts in each sheet, plate and fixture, by its path in the package.
    """
    rows = list(bill(specimen, asked, density, contents))
    names = [field.name for field in fields(BillRow)]
    heading = [name + (f"_{_UNITS[name]}" if name in _UNITS else "") for name in names]
    lines = [",".join(heading)]
    lines += [",".join(_cell(getattr(row, name)) for name in names) for row in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def bill(
    specimen: BuiltSpecimen,
    asked: Fabrication,
    density: float,
    contents: Mapping[str, Sequence[str]],
) -> Iterator[BillRow]:
    """Rows of the bill: each unit, each kind of shim, each file to cut or print, the totals."""
    holders: dict[str, list[str]] = {}
    for file, parts in contents.items():
        for part in dict.fromkeys(parts):
            holders.setdefault(part, []).append(file)
    units = [_unit(unit, density, holders) for unit in specimen.units]
    shims = [_shim(shim, asked, holders) for shim in specimen.shims]
    yield from units
    yield from shims
    for file, parts in contents.items():
        yield BillRow(_kind(file), file, 1, note=_counted(len(parts), "part"))
    yield from _totals(units, shims, asked)


def _unit(unit: Unit, density: float, holders: Mapping[str, Sequence[str]]) -> BillRow:
    x0, y0, x1, y1 = unit.outline.bounds
    return BillRow(
        "unit",
        unit.label,
        1,
        area=unit.outline.area,
        volume=unit.outline.area * unit.height,
        mass=unit.design.area * density * _GRAMS,
        length=x1 - x0,
        width=y1 - y0,
        height=unit.height,
        files=" ".join(holders.get(unit.label, ())),
        note=f"column {unit.column + 1} row {unit.row + 1}{_letter(unit)}{_slots(unit)}",
    )


def _letter(unit: Unit) -> str:
    return f"; carries {unit.letter} for its id" if unit.letter else ""


def _slots(unit: Unit) -> str:
    """Depths of the slots, by vertex, and the thinnest wall."""
    if not unit.slots:
        return ""
    slots = sorted(unit.slots, key=lambda slot: slot.vertex)
    depths = " ".join(f"{slot.depth:g}" for slot in slots)
    warning = " (thin)" if unit.wall < THIN_WALL else ""
    return f"; slots {depths} mm deep; walls from {unit.wall:.2f} mm{warning}"


def _shim(shim: Shim, asked: Fabrication, holders: Mapping[str, Sequence[str]]) -> BillRow:
    area = shim.length * shim.width
    return BillRow(
        "shim",
        shim.id,
        shim.count,
        area=area,
        volume=area * asked.shims.thickness,
        mass=area * asked.shims.thickness * FOIL * _GRAMS,
        length=shim.length,
        width=shim.width,
        height=asked.shims.thickness,
        files=" ".join(holders.get(shim.id, ())),
        note=f"{_counted(len(shim.ligaments), 'ligament')}, {_counted(shim.spares, 'spare')}",
    )


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _kind(file: str) -> str:
    """What a file is, by its folder."""
    return {"laser": "sheet", "print": "plate", "fixture": "fixture"}[file.partition("/")[0]]


def _totals(
    units: Sequence[BillRow], shims: Sequence[BillRow], asked: Fabrication
) -> Iterator[BillRow]:
    """Mass and volume of all units and of all shims, and how full to print for that mass."""
    mass, volume = _sum(units, "mass"), _sum(units, "volume")
    solid = volume * DENSITIES[asked.material] * _GRAMS
    told = f"{asked.material}; {solid:.1f} g if solid: print {100 * mass / solid:.0f} % full"
    if mass > solid:
        told = f"{asked.material}; {solid:.1f} g if solid: less than the problem's density asks for"
    yield BillRow("total", "units", len(units), volume=volume, mass=mass, note=told)
    count = sum(row.count for row in shims)
    volume, mass = _sum(shims, "volume"), _sum(shims, "mass")
    yield BillRow("total", "shims", count, volume=volume, mass=mass, note="polyester")


def _sum(rows: Sequence[BillRow], name: str) -> float:
    return float(sum(row.count * getattr(row, name) for row in rows))


def _cell(value: str | float | None) -> str:
    if value is None:
        return ""
    text = f"{value:.4f}" if isinstance(value, float) else str(value)
    return f'"{text}"' if "," in text else text
