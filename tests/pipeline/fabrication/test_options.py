"""Packages with other parameters than the defaults pass the same checks."""

from pathlib import Path
from typing import Literal, TypeAlias

import pytest
from ezdxf.filemanagement import readfile

from pipeline.fabrication.checks import check_package
from pipeline.fabrication.files.drawing_files import write_dxf
from pipeline.fabrication.plates import LaserSheet
from tests.pipeline.fabrication import built
from tests.tables import tables

DxfVersion: TypeAlias = Literal["R2010", "R12"]

OPTIONS: dict[str, dict[str, object]] = tables("fabrication")["options"]


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
