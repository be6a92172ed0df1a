"""Records of a sheet as ezdxf writes the same curves as entities."""

import io
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from shapely import box

from pipeline.fabrication.files import drawing_files
from pipeline.fabrication.parts import Circle, FlatPart
from pipeline.fabrication.plates import LaserSheet

STROKE = np.array([[12.0, 12.0], [12.0, 12.0], [12.1234567, 14.0], [-0.0, 1e-7]])
PART = FlatPart(
    "A1",
    box(10.0, 10.0, 30.0, 25.5),
    4.0,
    holes=(Circle((20.0, 1.0 / 3.0), 0.3),),
    engraving=(STROKE,),
    scores=(STROKE + 1.0,),
)
TABBED = FlatPart("S8", box(40.0, 10.0, 50.0, 14.0), 0.1, tabs=(Circle((45.0, 10.0), 0.5),))
SHEET = LaserSheet("units_sheet1_nominal", (100.0, 60.0), (PART, TABBED))


@pytest.mark.parametrize("version", ["R2010", "R12"])
def test_records_are_the_bytes_that_ezdxf_writes(
    tmp_path: Path, version: Literal["R2010", "R12"]
) -> None:
    path = tmp_path / "sheet.dxf"
    drawing_files.write_dxf(SHEET, path, version)
    assert path.read_text(encoding="utf-8") == as_entities(version)


WRITER = """
import sys
from pipeline.fabrication.files.drawing_files import new_document
new_document("R2010", (100.0, 60.0)).write(sys.stdout)
"""


def test_a_document_is_the_same_whatever_the_seed_of_hashes() -> None:
    """Ezdxf lists the classes that a document needs in a set: two seeds that order it otherwise."""
    written = [
        subprocess.run(
            [sys.executable, "-c", WRITER],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            check=True,
        ).stdout
        for seed in "05"
    ]
    assert written[0] == written[1]
    assert b"CLASSES" in written[0]


def as_entities(version: str) -> str:
    document = drawing_files.new_document(version, SHEET.size)
    space: Any = document.modelspace()
    add = space.add_polyline2d if version == "R12" else space.add_lwpolyline
    rim = [(0.0, 0.0), (100.0, 0.0), (100.0, 60.0), (0.0, 60.0)]
    add(rim, close=True, dxfattribs={"layer": "REFERENCE"})
    for part in SHEET.parts:
        lines = [(stroke, "ENGRAVE") for stroke in part.engraving]
        lines += [(stroke, "SCORE") for stroke in part.scores]
        made = [add(distinct(line), dxfattribs={"layer": layer}) for line, layer in lines]
        look = {"layer": "CUT_INNER"}
        made += [space.add_circle(h.centre, h.diameter / 2, dxfattribs=look) for h in part.holes]
        whole, look = not part.tabs, {"layer": "CUT_OUTER"}
        cuts = [distinct(cut[:-1] if whole else cut) for cut in part.cuts]
        made += [add(cut, close=whole, dxfattribs=look) for cut in cuts]
        for entity in made:
            entity.set_xdata(drawing_files.APPLICATION, [(1000, part.id)])
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()


def distinct(points: np.ndarray) -> list[list[float]]:
    rounded: list[list[float]] = np.round(points, 6).tolist()
    return [point for at, point in enumerate(rounded) if at == 0 or point != rounded[at - 1]]
