"""Writes meshes: STL for one part, 3MF for a plate of named parts; always the same bytes."""

import zipfile
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from pipeline.fabrication.parts import Mesh
from sim.core import Floats, Ints

_EPOCH = (1980, 1, 1, 0, 0, 0)  # the first date that a zip file can hold
_HEADER = b"millimetres".ljust(80, b"\0")  # programs in C read it as far as a zero

_TYPES = """<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"""
_RELATIONS = """<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Id="rel0" Target="/3D/3dmodel.model"
 Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"""
_MODEL = """<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US"
 xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources>
{objects}</resources>
<build>
{items}</build>
</model>
"""


def write_stl(meshes: Iterable[Mesh], path: Path) -> None:
    """Writes meshes as one binary STL, in mm."""
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in meshes]).astype("<f4")
    # Edges below single precision collapse; the triangles beside them go, and no hole is left.
    distinct = (corners != np.roll(corners, 1, axis=1)).any(axis=2).all(axis=1)
    corners = corners[distinct]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    facets = np.zeros(
        len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]
    )
    facets["normal"] = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    facets["corners"] = corners
    path.write_bytes(_HEADER + np.uint32(len(facets)).tobytes() + facets.tobytes())


def write_3mf(parts: Sequence[tuple[str, Mesh, float, float]], path: Path) -> None:
    """Writes a plate: name and mesh of each part, and where it lies, in mm."""
    objects = "".join(
        _object(number, name, mesh) for number, (name, mesh, _, _) in enumerate(parts, 1)
    )
    items = "".join(
        f'<item objectid="{number}" transform="1 0 0 0 1 0 0 0 1 {x:.5f} {y:.5f} 0"/>\n'
        for number, (_, _, x, y) in enumerate(parts, 1)
    )
    model = _MODEL.format(objects=objects, items=items)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as package:
        for name, content in (
            ("[Content_Types].xml", _TYPES),
            ("_rels/.rels", _RELATIONS),
            ("3D/3dmodel.model", model),
        ):
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            package.writestr(entry, content)


def _object(number: int, name: str, mesh: Mesh) -> str:
    vertices = _rows('<vertex x="%.5f" y="%.5f" z="%.5f"/>', mesh.vertices)
    faces = _rows('<triangle v1="%d" v2="%d" v3="%d"/>', mesh.faces)
    return (
        f'<object id="{number}" name="{name}" type="model"><mesh><vertices>{vertices}</vertices>'
        f"<triangles>{faces}</triangles></mesh></object>\n"
    )


def _rows(row: str, values: Floats | Ints) -> str:
    """Formats all rows of a table at once."""
    return (row * len(values)) % tuple(values.ravel().tolist())
