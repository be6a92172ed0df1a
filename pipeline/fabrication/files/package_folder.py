"""Writes the drawings and the meshes of a specimen into a folder."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pipeline.fabrication.files.drawing_files import write_dxf, write_svg
from pipeline.fabrication.files.mesh_files import write_3mf, write_stl
from pipeline.fabrication.fixtures import (
    comb,
    coupon,
    coupon_solid,
    fixtures,
    shim_pieces,
    templates,
)
from pipeline.fabrication.parts import BuiltSpecimen, FlatPart, PrintedPart, unit_solid
from pipeline.fabrication.plates import PrintEstimate, estimate_print, laser_sheets, print_plates
from pipeline.problem import Problem


@dataclass
class PackageFolder:
    """Fills a folder with laser/, print/ and fixture/."""

    folder: Path
    specimen: BuiltSpecimen
    problem: Problem
    file: str  # of the problem, for messages
    done: Callable[[], object] = lambda: None  # after each step, two more than there are units
    # by path in the folder: ids of the parts in each sheet, plate, fixture; what printing it takes
    contents: dict[str, list[str]] = field(default_factory=dict)
    prints: dict[str, PrintEstimate] = field(default_factory=dict)

    def write(self) -> None:
        """Writes all drawings and meshes.

        Raises:
            UserError: a part fits on no sheet or on no bed, or is too fine for the kerf.
        """
        self._write_laser()
        self.done()
        self._write_print()
        self._write_fixture()
        self.done()

    def _path(self, name: str, ids: Sequence[str] = ()) -> Path:
        """Makes the path of a file; notes the ids of what is cut or printed as one piece."""
        if ids:
            self.contents[name] = list(ids)
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def _write_laser(self) -> None:
        settings = self.problem.fabrication
        for kind, parts in self._flat_parts():
            laser = settings.laser.model_copy(update={"kerf": settings.kerf_of(kind)})
            for sheet in laser_sheets(kind, parts, laser, self.file):
                ids = [part.id for part in sheet.parts]
                write_dxf(sheet, self._path(f"laser/{sheet.name}.dxf", ids))
                write_dxf(sheet, self._path(f"laser/{sheet.name}_r12.dxf"), "R12")
                write_svg(sheet, self._path(f"laser/{sheet.name}.svg"))

    def _flat_parts(self) -> Iterator[tuple[str, Sequence[FlatPart]]]:
        """Yields kinds of sheets with their parts; a kind is cut from one material."""
        specimen, settings = self.specimen, self.problem.fabrication
        spacing = self.problem.lattice.spacing
        yield "units", [unit.part for unit in specimen.units]
        yield "shims", shim_pieces(specimen, settings)
        yield "template", list(templates(specimen, spacing, settings))
        yield "comb", [comb(specimen, spacing, settings)]
        yield "coupon", [coupon(settings, layered=settings.laminated)]

    def _write_print(self) -> None:
        settings, solids = self.problem.fabrication, []
        for unit in self.specimen.units:
            solids.append(unit_solid(unit, settings))
            write_stl([solids[-1].mesh], self._path(f"print/units/{unit.label}.stl"))
            self.done()
        self._write_plates("print/units", solids)
        self._write_plates("print/coupon", [coupon_solid(coupon(settings), settings)])
        placed = (solid.mesh.moved(*solid.bounds[:2]) for solid in solids)
        write_stl(placed, self._path("print/assembled.stl"))

    def _write_fixture(self) -> None:
        settings, spacing = self.problem.fabrication, self.problem.lattice.spacing
        solids = list(fixtures(self.specimen, settings, spacing))
        for solid in solids:
            placed = solid.mesh.moved(*solid.bounds[:2])
            write_stl([placed], self._path(f"fixture/{solid.id}.stl"))
        self._write_plates("fixture/fixture", solids)

    def _write_plates(self, kind: str, solids: Sequence[PrintedPart]) -> None:
        folder, _, name = kind.rpartition("/")
        bed = self.problem.fabrication.print
        for plate, parts in print_plates(name, solids, bed, self.file):
            file = f"{folder}/{plate}.3mf"
            path = self._path(file, [solid.id for solid, _, _ in parts])
            on_plate = [solid for solid, _, _ in parts]
            self.prints[file] = estimate_print(on_plate, self.problem.infill)
            write_3mf([(solid.id, solid.mesh, x, y) for solid, x, y in parts], path)
