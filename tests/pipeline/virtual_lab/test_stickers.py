import base64
import re
import zlib
from pathlib import Path

import numpy as np
import pytest

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.tracking.frames import import_video
from tests.pipeline.conftest import Failing
from tests.pipeline.tracking.test_dic_points import SMALL

POINT = 72 / 25.4


def drawn(path: Path) -> list[str]:
    """The drawing commands of every page."""
    parts = re.findall(rb"stream\r?\n(.*?)~>\s*endstream", path.read_bytes(), re.DOTALL)
    return [zlib.decompress(base64.a85decode(part)).decode("latin-1") for part in parts]


@pytest.fixture
def design(tmp_path: Path) -> Path:
    datasets.write(import_video.design(SMALL), tmp_path / "design.nc", "design", {"problem": "{}"})
    return tmp_path / "design.nc"


def test_faces_and_dots_have_their_size(design: Path, tmp_path: Path) -> None:
    outs = [tmp_path / name / "marks.pdf" for name in ("a", "b")]
    for out in outs:
        words = ["--design", str(design), "--out", str(out), "--diameter", "2.5", "--count", "2"]
        assert run_stage("markers", [*words, "--spread", "5", "--quiet"]) == 0
    assert outs[0].read_bytes() == outs[1].read_bytes()
    (page,) = drawn(outs[0])
    circles = re.findall(r"([\d.]+) ([\d.]+) m((?: [\d.]+){6} c){4}", page.replace("\n", " "))
    right = np.array([[float(x), float(y)] for x, y, _ in circles]) / POINT
    assert len(right) == 2 * 16
    np.testing.assert_allclose(np.linalg.norm(right[1::2] - right[::2], axis=1), 5.0, atol=1e-2)
    bar = re.search(r"([\d.]+) 5.669\d* re", page)
    assert bar is not None
    assert float(bar.group(1)) / POINT == pytest.approx(100.0, abs=1e-3)


def test_speckle_is_thrown_on_all_faces(design: Path, tmp_path: Path) -> None:
    out = tmp_path / "speckle.pdf"
    words = ["--design", str(design), "--out", str(out), "--kind", "speckle", "--faces", "light"]
    assert run_stage("markers", [*words, "--quiet"]) == 0
    (page,) = drawn(out)
    assert page.count(" c ") + page.count(" c\n") > 16 * 10 * 4


@pytest.mark.parametrize(
    ("option", "value"), [("diameter", "40"), ("diameter", "0"), ("spread", "0"), ("spread", "200")]
)
def test_dots_beyond_print_are_refused(
    design: Path, tmp_path: Path, failing: Failing, option: str, value: str
) -> None:
    words = ["--design", str(design), "--out", str(tmp_path / "marks.pdf"), f"--{option}", value]
    told = failing("markers", words)
    assert "cannot be printed" in told
    assert f"--{option}" in told
    assert f"value:  {float(value)}" in told
