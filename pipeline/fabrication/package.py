"""Writes the drawings and the meshes of a specimen into a folder."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import shapely

from pipeline.fabrication import dxf, dxf_r12, flat, meshes, svg
from pipeline.fabrication.fixtures import fixtures
from pipeline.fabrication.jig import jig
from pipeline.fabrication.parts import Part, Specimen
from pipeline.fabrication.plates import plates
from pipeline.fabrication.sheets import sheets
from pipeline.fabrication.solids import Layer, Solid, pen, unit_solid
from pipeline.fabrication.strips import strip_parts
from pipeline.problem import Problem
from pipeline.problem.fabrication import Fabrication

Done = Callable[[], object]


@dataclass
class Package:
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
    specimen: Specimen
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


def steps(specimen: Specimen) -> int:
    """How often `write` tells of progress."""
    return len(specimen.units) + 2


def write(package: Package) -> None:
    """Write laser/, print/ and fixture/.

    Raises:
        UserError: a part fits on no sheet or on no bed, or is too fine for the kerf.
    """
    _laser(package)
    package.done()
    _print(package)
    _fixture(package)
    package.done()


def _laser(package: Package) -> None:
    for kind, parts in _flat_parts(package):
        for sheet in sheets(kind, parts, package.wanted.laser, package.file):
            dxf.write(sheet, package.path(f"laser/{sheet.name}.dxf", sheet.ids))
            dxf_r12.write(sheet, package.path(f"laser/{sheet.name}_r12.dxf"))
            svg.write(sheet, package.path(f"laser/{sheet.name}.svg"))


def _flat_parts(package: Package) -> Iterator[tuple[str, Sequence[Part]]]:
    """Kinds of sheets with their parts; a kind is cut from one material."""
    specimen, wanted, lattice = package.specimen, package.wanted, package.asked.lattice
    yield "units", [unit.part for unit in specimen.units]
    yield "shims", flat.shim_pieces(specimen, wanted)
    if wanted.shims.strips:
        yield "strips", strip_parts(specimen, wanted)
    yield "template", list(flat.templates(specimen, lattice.spacing, wanted))
    yield "comb", [flat.comb(specimen, lattice.spacing, lattice.ligament_length, wanted)]
    yield "coupon", [flat.coupon(wanted)]


def _print(package: Package) -> None:
    wanted, units = package.wanted, package.specimen.units
    solids = []
    for unit in units:
        solid = unit_solid(unit, wanted)
        meshes.write_stl([solid.mesh], package.path(f"print/units/{solid.id}.stl"))
        solids.append(solid)
        package.done()
    _plates(package, "print/units", solids)
    _plates(package, "print/coupon", [coupon_solid(flat.coupon(wanted), wanted)])
    placed = (solid.mesh.moved(*solid.bounds[:2]) for solid in solids)
    meshes.write_stl(placed, package.path("print/assembled.stl"))


def coupon_solid(part: Part, wanted: Fabrication) -> Solid:
    """The coupon, its clearances sunk into its top."""
    sunk = pen(part.engraving, min(wanted.labels.stroke, 0.4))
    top = part.height - wanted.labels.depth
    upper = shapely.set_precision(part.outline.difference(sunk), 1e-3)
    return Solid(part.id, (Layer(part.outline, 0.0, top), Layer(upper, top, part.height)))


def _fixture(package: Package) -> None:
    told = (package.specimen, package.wanted, package.asked.lattice.spacing)
    solids = [*fixtures(*told), *jig(*told)]
    for solid in solids:
        meshes.write_stl([solid.mesh], package.path(f"fixture/{solid.id}.stl"))
    _plates(package, "fixture/fixture", solids)


def _plates(package: Package, kind: str, solids: Iterable[Solid]) -> None:
    folder, _, name = kind.rpartition("/")
    for plate in plates(name, list(solids), package.wanted.print, package.file):
        path = package.path(f"{folder}/{plate.name}.3mf", plate.ids)
        meshes.write_3mf([(solid.id, solid.mesh, x, y) for solid, x, y in plate.parts], path)
