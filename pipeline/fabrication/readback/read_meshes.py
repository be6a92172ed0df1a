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

from pipeline.fabrication.readback.faults import BUG, Fault, unreadable
from sim.core import Floats, Ints

if TYPE_CHECKING:
    from lxml.etree import _Element
    from manifold3d import Manifold
    from shapely import Geometry
    from trimesh import Trimesh


TOLERANCE = 1e-3
"""Lengths of a mesh are right to this, mm (binary STL holds single precision)."""

VOLUME_TOLERANCE = 1e-3
"""Relative difference of volume that two files of one part may have."""

_CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"


@dataclass(frozen=True)
class MeshBody:
    """Holds one body of a file: its name, its vertices (n, 3) in mm and its triangles (m, 3)."""

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

    @cached_property
    def extent(self) -> tuple[Floats, Floats]:
        """Lower and upper corner of its bounding box."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    def section(self, height: float) -> Geometry:
        """Cuts the body by a plane at this height."""
        rings = self.manifold.slice(height).to_polygons()
        lines = [shapely.LinearRing(ring) for ring in rings if len(ring) > 2]
        return shapely.build_area(shapely.MultiLineString(lines))

    def fault(self, what: str, key: str = "print", remedy: str = BUG) -> Fault:
        """Makes a fault of the body, seen from the top."""
        around: tuple[Geometry, ...] = ()
        points = self.vertices[np.isfinite(self.vertices).all(axis=1), :2]
        if len(points) > 2:
            edges = points[self.triangles[(self.triangles < len(points)).all(axis=1)]]
            around = (shapely.MultiLineString([[a, b, c, a] for a, b, c in edges[:2000]]),)
        return Fault(f"part {self.name}", what, key, remedy, self.file, around)


def read_stl(path: Path) -> MeshBody:
    """Reads the mesh of an STL file, named by the file.

    Raises:
        UserError: it is not one.
    """
    import trimesh

    try:
        mesh = trimesh.load_mesh(path, file_type="stl", process=False)
    except (OSError, ValueError, IndexError) as error:
        raise unreadable("a mesh", path, error) from error
    if len(mesh.faces) == 0:
        raise unreadable("a mesh", path, "it holds no triangles")
    return MeshBody(path, path.stem, np.asarray(mesh.vertices), np.asarray(mesh.faces))


def read_3mf(path: Path) -> tuple[MeshBody, ...]:
    """Reads the objects of a 3MF file, where the plate has them.

    Raises:
        UserError: it is not one, or not in millimetres.
    """
    from lxml import etree

    try:
        with zipfile.ZipFile(path) as package:
            root = etree.fromstring(package.read("3D/3dmodel.model"))
    except (OSError, KeyError, zipfile.BadZipFile, etree.XMLSyntaxError) as error:
        raise unreadable("a mesh", path, error) from error
    if root.get("unit") != "millimeter":
        raise unreadable("a mesh", path, f"its unit is {root.get('unit')!r}, not millimeter")
    objects = {body.get("id"): body for body in root.iter(f"{_CORE}object")}
    return tuple(
        _placed(path, objects[item.get("objectid")], item.get("transform"))
        for item in root.iter(f"{_CORE}item")
    )


def _placed(path: Path, body: _Element, transform: str | None) -> MeshBody:
    vertices = _table(body, "vertex", ("x", "y", "z"))
    triangles = _table(body, "triangle", ("v1", "v2", "v3")).astype(np.int64)
    if transform:
        matrix = np.array(transform.split(), dtype=float).reshape(4, 3)
        vertices = vertices @ matrix[:3] + matrix[3]
    return MeshBody(path, str(body.get("name") or ""), vertices, triangles)


def _table(body: _Element, tag: str, columns: Sequence[str]) -> Floats:
    values = [row.get(column, "nan") for row in body.iter(_CORE + tag) for column in columns]
    return np.array(list(map(float, values))).reshape(-1, len(columns))


def check_solid(solid: MeshBody, *, bodies: int = 1) -> Iterator[Fault]:
    """Checks a solid as such: closed, wound, of so many bodies, and on the bed (z = 0)."""
    what = _surface_fault(solid)
    if what is not None:
        yield solid.fault(what)
        return
    count, lowest = solid.mesh.body_count, solid.extent[0][2]
    if count != bodies:
        what = f"it falls into {count} pieces instead of {bodies}"
        yield solid.fault(what, "slots.depth_max")
    if abs(lowest) > TOLERANCE:
        yield solid.fault(f"it starts at z = {lowest:.3f} mm instead of 0 mm")


def _surface_fault(solid: MeshBody) -> str | None:
    from manifold3d import Error

    if not np.isfinite(solid.vertices).all():
        return "vertices that are no numbers"
    mesh = solid.mesh
    tests = (
        (mesh.is_watertight, "its surface has holes"),
        (mesh.is_winding_consistent, "its triangles are not wound all the same way"),
        (mesh.volume > 0.0, "it is inside out"),
        (
            len(mesh.faces) == len(solid.triangles),
            "some of its triangles have no area or are there twice",
        ),
        (mesh.is_volume and solid.manifold.status() == Error.NoError, "it bounds no volume"),
    )
    return next((what for passed, what in tests if not passed), None)


def check_volume(solid: MeshBody, levels: Sequence[float]) -> Iterator[Fault]:
    """Checks that the volume is the area times the height, layer by layer between `levels`, mm."""
    layers = list(pairwise(levels))
    expected = sum(solid.section((low + high) / 2).area * (high - low) for low, high in layers)
    volume = solid.mesh.volume
    if abs(volume - expected) > VOLUME_TOLERANCE * expected:
        what = f"its volume is {volume:.2f} mm^3, area times height {expected:.2f} mm^3"
        yield solid.fault(what)
