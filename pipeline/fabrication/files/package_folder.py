"""Writes the drawings and the meshes of a specimen into a folder."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import shapely

from pipeline.fabrication.files import dxf, dxf_r12, mesh_files, svg
from pipeline.fabrication.fixtures import fixtures, flat_parts, jig, strip_parts
from pipeline.fabrication.parts import BuiltSpecimen, FlatPart, Layer, PrintedPart, pen, unit_solid
from pipeline.fabrication.plates import plates, sheets
from pipeline.problem import Problem
from pipeline.problem.sections import Fabrication

Done = Callable[[], object]


@dataclass
class PackageFolder:
    """A folder that is being filled.

    Attributes:
        folder: where.
        specimen: what is built.
        asked: the problem with all its parameters.
        file: of the problem, for messages.
        done: called after each of the steps.
        contents: ids of the parts in each sheet, plate and fixture, by its path in the folder.
    """

    folder: Path
    specimen: BuiltSpecimen
    asked: Problem
    file: str
    done: Done = lambda: None
    contents: dict[str, list[str]] = field(default_factory=dict)

    @property
    def wanted(self) -> Fabrication:
        """The parameters of fabrication."""
        return self.asked.fabrication

    def path(self, name: str, ids: Sequence[str] = ()) -> Path:
        """The path of a file; one that is cut or printed as a whole is told what it holds."""
        if ids:
            self.contents[name] = list(ids)
        made = self.folder / name
        made.parent.mkdir(parents=True, exist_ok=True)
        return made


def steps(specimen: BuiltSpecimen) -> int:
    """How often `write` tells of progress."""
    return len(specimen.units) + 2


def write(package: PackageFolder) -> None:
    """Write laser/, print/ and fixture/.

    Raises:
        UserError: a part fits on no sheet or on no bed, or is too fine for the kerf.
    """
    _laser(package)
    package.done()
    _print(package)
    _fixture(package)
    package.done()


def _laser(package: PackageFolder) -> None:
    for kind, parts in _flat_parts(package):
        for sheet in sheets(kind, parts, package.wanted.laser, package.file):
            dxf.write(sheet, package.path(f"laser/{sheet.name}.dxf", sheet.ids))
            dxf_r12.write(sheet, package.path(f"laser/{sheet.name}_r12.dxf"))
            svg.write(sheet, package.path(f"laser/{sheet.name}.svg"))


def _flat_parts(package: PackageFolder) -> Iterator[tuple[str, Sequence[FlatPart]]]:
    """Kinds of sheets with their parts; a kind is cut from one material."""
    specimen, wanted, lattice = package.specimen, package.wanted, package.asked.lattice
    yield "units", [unit.part for unit in specimen.units]
    yield "shims", flat_parts.shim_pieces(specimen, wanted)
    if wanted.shims.strips:
        yield "strips", strip_parts(specimen, wanted)
    yield "template", list(flat_parts.templates(specimen, lattice.spacing, wanted))
    yield "comb", [flat_parts.comb(specimen, lattice.spacing, lattice.ligament_length, wanted)]
    yield "coupon", [flat_parts.coupon(wanted)]


def _print(package: PackageFolder) -> None:
    wanted, units = package.wanted, package.specimen.units
    solids = []
    for unit in units:
        solid = unit_solid(unit, wanted)
        mesh_files.write_stl([solid.mesh], package.path(f"print/units/{solid.id}.stl"))
        solids.append(solid)
        package.done()
    _plates(package, "print/units", solids)
    _plates(package, "print/coupon", [coupon_solid(flat_parts.coupon(wanted), wanted)])
    placed = (solid.mesh.moved(*solid.bounds[:2]) for solid in solids)
    mesh_files.write_stl(placed, package.path("print/assembled.stl"))


def coupon_solid(part: FlatPart, wanted: Fabrication) -> PrintedPart:
    """The coupon, its clearances sunk into its top."""
    sunk = pen(part.engraving, min(wanted.labels.stroke, 0.4))
    top = part.height - wanted.labels.depth
    upper = shapely.set_precision(part.outline.difference(sunk), 1e-3)
    return PrintedPart(part.id, (Layer(part.outline, 0.0, top), Layer(upper, top, part.height)))


def _fixture(package: PackageFolder) -> None:
    told = (package.specimen, package.wanted, package.asked.lattice.spacing)
    solids = [*fixtures(*told), *jig(*told)]
    for solid in solids:
        mesh_files.write_stl([solid.mesh], package.path(f"fixture/{solid.id}.stl"))
    _plates(package, "fixture/fixture", solids)


def _plates(package: PackageFolder, kind: str, solids: Iterable[PrintedPart]) -> None:
    folder, _, name = kind.rpartition("/")
    for plate in plates(name, list(solids), package.wanted.print, package.file):
        path = package.path(f"{folder}/{plate.name}.3mf", plate.ids)
        mesh_files.write_3mf([(solid.id, solid.mesh, x, y) for solid, x, y in plate.parts], path)
