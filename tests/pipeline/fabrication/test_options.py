"""Packages with other parameters than the defaults pass the same checks."""

from pathlib import Path
from typing import Literal, TypeAlias

import pytest
from ezdxf.filemanagement import readfile

from pipeline.fabrication.checks import check_package
from pipeline.fabrication.files.drawing_files import write_dxf
from pipeline.fabrication.plates import LaserSheet
from tests.pipeline.fabrication import built

DxfVersion: TypeAlias = Literal["R2010", "R12"]

OPTIONS: dict[str, dict[str, object]] = {
    "free shims, recesses, no kerf": {
        "slots": {"direction": "ligament"},
        "markers": {"kind": "recess", "count": 1},
        "print": {"first_layer_inset": "0.15 mm"},
        "laser": {"kerf": "0 mm"},
        "shims": {"tabs": None},
        "paper": "Letter",
    },
    "raised dots, other sheet and bed": {
        "slots": {"direction": "bisector"},
        "markers": {"kind": "dots", "count": 3},
        "print": {"bed": ["180 mm", "180 mm"]},
        "laser": {"kerf": "0.3 mm", "sheet": ["300 mm", "200 mm"], "aspect_ratio": 15.0},
        "shims": {"tabs": {"width": "0.6 mm", "count": 4}},
        "fillet_radius": "0.5 mm",
        "thickness": "6 mm",
        "material": "PMMA",
        "coupon": ["0.05 mm", "0.1 mm"],
    },
    "other foil": {
        "slots": {"clearance": "0.05 mm", "depth": "2.5 mm", "depth_max": "4 mm", "tip": "0.3 mm"},
        "shims": {"thickness": "0.5 mm", "spares": 0.3, "tabs": {"count": 1}},
        "laser": {"pin": "3 mm"},
        "labels": {"height": "2.5 mm", "stroke": "0.3 mm"},
        "coupon": ["0 mm", "0.1 mm"],
    },
}


@pytest.mark.parametrize("version", ["R2010", "R12"])
def test_a_drawing_says_how_far_it_extends(tmp_path: Path, version: DxfVersion) -> None:
    write_dxf(LaserSheet("empty", (600.0, 300.0), ()), tmp_path / "empty.dxf", version)
    header = readfile(tmp_path / "empty.dxf").header
    assert tuple(header["$EXTMIN"])[:2] == (0.0, 0.0)
    assert tuple(header["$EXTMAX"])[:2] == (600.0, 300.0)


@pytest.mark.parametrize("name", OPTIONS)
def test_other_parameters_make_a_right_package(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "cloaked"
    asked = built.write(folder, OPTIONS[name]).fabrication
    check_package(folder, built.design(), "cloaked", asked, tmp_path / "faults")
