"""Reads a written mesh, STL or 3MF, as solids in millimetres, and checks that they are solids."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from pipeline.fabrication.readback.faults import BUG, Fault
from pipeline.runtime import UserError
from sim.core import Floats, Ints

if TYPE_CHECKING:
    from lxml.etree import _Element
    from manifold3d import Manifold
    from shapely import Geometry
    from trimesh import Trimesh


TOLERANCE = 1e-3
"""Lengths of a mesh are right to this, mm (binary STL holds single precision)."""

VOLUME_TOLERANCE = 1e-3
_CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"


@dataclass(frozen=True)
class MeshBody:
    """One body of a file: its name, its vertices (n, 3) in mm and its triangles (m, 3)."""

    file: Path
    name: str
    vertices: Floats
    triangles: Ints

    @cached_property
    def mesh(self) -> Trimesh:
        """The body for trimesh, equal vertices made one."""
        from trimesh import Trimesh

        return Trimesh(self.vertices, self.triangles, process=True)

    @cached_property
    def manifold(self) -> Manifold:
        """The body for manifold3d."""
        from manifold3d import Manifold, Mesh

        faces = np.ascontiguousarray(self.mesh.faces, dtype=np.uint32)
        return Manifold(Mesh(np.ascontiguousarray(self.mesh.vertices, dtype=np.float32), faces))

    @property
    def extent(self) -> tuple[Floats, Floats]:
        """Lower and upper corner of its bounding box."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    def section(self, height: float) -> Geometry:
        """What a plane at this height cuts."""
        rings = self.manifold.slice(height).to_polygons()
        lines = [shapely.LinearRing(ring) for ring in rings if len(ring) > 2]
        return shapely.build_area(shapely.MultiLineString(lines))


def read_stl(path: Path) -> MeshBody:
    """The mesh of an STL file, named by the file.

    Raises:
        UserError: it is not one.
    """
    import trimesh

    try:
        mesh = trimesh.load_mesh(path, file_type="stl", process=False)
    except (OSError, ValueError, IndexError) as error:
        raise _unreadable(path, str(error)) from error
    if len(mesh.faces) == 0:
        raise _unreadable(path, "it holds no triangles")
    return MeshBody(path, path.stem, np.asarray(mesh.vertices), np.asarray(mesh.faces))


def read_3mf(path: Path) -> tuple[MeshBody, ...]:
    """The objects of a 3MF file, where the plate has them.

    Raises:
        UserError: it is not one, or not in millimetres.
    """
    from lxml import etree

    try:
        with zipfile.ZipFile(path) as package:
            root = etree.fromstring(package.read("3D/3dmodel.model"))
    except (OSError, KeyError, zipfile.BadZipFile, etree.XMLSyntaxError) as error:
        raise _unreadable(path, str(error)) from error
    if root.get("unit") != "millimeter":
        raise _unreadable(path, f"its unit is {root.get('unit')!r}, not millimeter")
    objects = {found.get("id"): found for found in root.iter(f"{_CORE}object")}
    items = list(root.iter(f"{_CORE}item"))
    return tuple(_placed(path, objects[item.get("objectid")], item) for item in items)


def _placed(path: Path, body: _Element, item: _Element) -> MeshBody:
    vertices = _table(body, "vertex", ("x", "y", "z"))
    triangles = _table(body, "triangle", ("v1", "v2", "v3")).astype(np.int64)
    if transform := item.get("transform"):
        matrix = np.array(transform.split(), dtype=float).reshape(4, 3)
        vertices = vertices @ matrix[:3] + matrix[3]
    return MeshBody(path, str(body.get("name") or ""), vertices, triangles)


def _table(body: _Element, tag: str, columns: Sequence[str]) -> Floats:
    rows = [[float(row.get(column, "nan")) for column in columns] for row in body.iter(_CORE + tag)]
    return np.array(rows).reshape(-1, len(columns))


def check(solid: MeshBody, *, bodies: int = 1, floor: float | None = 0.0) -> Iterator[Fault]:
    """Faults of a solid as such: holes, winding, parts, and whether it stands on the bed.

    Args:
        solid: of a written file.
        bodies: how many it should hold that do not touch.
        floor: its lowest point, mm; None where that is free.
    """
    faults = list(_surface(solid))
    if not faults:
        faults = list(_body(solid, bodies, floor))
    yield from faults


def _surface(solid: MeshBody) -> Iterator[Fault]:
    from manifold3d import Error

    if not np.isfinite(solid.vertices).all():
        yield fault(solid, "vertices that are no numbers")
        return
    mesh = solid.mesh
    if not mesh.is_watertight:
        yield fault(solid, "its surface has holes")
    elif not mesh.is_winding_consistent:
        yield fault(solid, "its triangles are not wound all the same way")
    elif mesh.volume <= 0.0:
        yield fault(solid, "it is inside out")
    elif len(mesh.faces) != len(solid.triangles):
        yield fault(solid, "some of its triangles have no area or are there twice")
    elif not mesh.is_volume or solid.manifold.status() != Error.NoError:
        yield fault(solid, "it bounds no volume")


def _body(solid: MeshBody, bodies: int, floor: float | None) -> Iterator[Fault]:
    count = solid.mesh.body_count
    if count != bodies:
        yield fault(solid, f"it falls into {count} pieces instead of {bodies}", "slots.depth_max")
    lowest = solid.extent[0][2]
    if floor is not None and abs(lowest - floor) > TOLERANCE:
        yield fault(solid, f"it starts at z = {lowest:.3f} mm instead of {floor:g} mm")


def volume(solid: MeshBody, levels: Sequence[float]) -> Iterator[Fault]:
    """Whether the volume is the area times the height, layer by layer between `levels` (mm)."""
    layers = list(pairwise(levels))
    areas = [solid.section((low + high) / 2).area for low, high in layers]
    wanted = sum(area * (high - low) for area, (low, high) in zip(areas, layers, strict=True))
    made = solid.mesh.volume
    if abs(made - wanted) > VOLUME_TOLERANCE * wanted:
        yield fault(solid, f"its volume is {made:.2f} mm^3, area times height {wanted:.2f} mm^3")


def fault(solid: MeshBody, what: str, key: str = "print", remedy: str = BUG) -> Fault:
    """A fault of the whole solid, seen from the top."""
    around: tuple[Geometry, ...] = ()
    points = solid.vertices[np.isfinite(solid.vertices).all(axis=1), :2]
    if len(points) > 2:
        edges = points[solid.triangles[(solid.triangles < len(points)).all(axis=1)]]
        around = (shapely.MultiLineString([[a, b, c, a] for a, b, c in edges[:2000]]),)
    return Fault(f"part {solid.name}", what, key, remedy, solid.file, around)


def _unreadable(path: Path, why: str) -> UserError:
    return UserError(
        f"a mesh that was just written cannot be read back: {why}", file=path, remedy=BUG
    )
