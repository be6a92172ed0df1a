"""Problems that can be read but have no meaning: one message, whatever stage meets them."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.__main__ import run_stage
from pipeline.posing import scene_of
from pipeline.posing.to_scene import contact_laws
from pipeline.problem.reading import load
from sim.structure import VoidAngleContact
from tests.pipeline.static import SHIELD, write
from tests.tables import cases, refused

SERIES = "{ kind: time_series, units: right, file: push.csv }"


def with_drive(folder: Path, drive: str) -> Path:
    path = write(folder, SHIELD, amplitude=9)
    text = path.read_text(encoding="utf-8")
    ramp = text[text.index("drive:") : text.index("horizon:")]
    path.write_text(text.replace(ramp, f"drive: {drive}\n"), encoding="utf-8")
    return path


def test_the_law_of_contact_is_that_of_the_problem(fig2: Path) -> None:
    laws = contact_laws(load(fig2))
    assert laws["angle"] == VoidAngleContact(np.deg2rad(-15.0), np.deg2rad(-10.0))
    assert scene_of(load(fig2), fig2.parent).structure.contact == laws["angle"]


def design(path: Path, out: Path, capfd: pytest.CaptureFixture[str]) -> str:
    words = ["--problem", str(path), "--method", "sqp", "--out", str(out)]
    assert run_stage("design", words) == 2
    told = capfd.readouterr().err
    assert "Traceback" not in told
    assert not out.exists()
    return told


@cases("posing", "old, new, key")
def test_the_file_the_key_and_a_remedy_are_told(
    old: str, new: str, key: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, SHIELD, amplitude=9)
    text = path.read_text(encoding="utf-8").replace("amplitude: 9.0 mm", "amplitude: 9 mm")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    told = design(path, tmp_path / "design.nc", capfd)
    assert f"file:   {path}\n" in told
    assert f"key:    {key}" in told
    assert "remedy: " in told


@pytest.mark.parametrize("drive", ["[1, 2]", "3", "[]"])
def test_a_drive_that_is_no_section_is_told_in_words(drive: str, tmp_path: Path) -> None:
    path = with_drive(tmp_path, drive)
    with refused("keys and values are wanted here", "drive"):
        load(path)


@cases("posing", "rows, what")
def test_a_measured_drive_that_cannot_be_meant(
    rows: str, what: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = with_drive(tmp_path, SERIES)
    path.write_text(path.read_text(encoding="utf-8").replace(", steps: 4", ", samples: 5"))
    series = "".join(f"{row},0,0\n" for row in rows.splitlines())
    (tmp_path / "push.csv").write_text(f"time (s),ux (mm),uy (mm),theta (rad)\n{series}")
    assert what in design(path, tmp_path / "design.nc", capfd)
