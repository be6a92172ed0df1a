import csv
import json
import logging
import shutil
from pathlib import Path

import av
import numpy as np
import pytest
import yaml

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.tracking.frames import load_cell, load_recording
from pipeline.tracking.frames.recording import LoadCellLog
from pipeline.virtual_lab.filming import VirtualFilm
from tests.pipeline.conftest import Failing
from tests.pipeline.virtual_lab.conftest import SETUP
from tests.tables import cases, refused


def recording(folder: Path, **changes: object) -> Path:
    path = folder / "asked.yaml"
    setup = {**SETUP, "end": "0.3 s", **changes}
    path.write_text(yaml.safe_dump({"specimen": "dots", "virtual": setup}), encoding="utf-8")
    return path


def words(files: Path, asked: Path, out: Path) -> list[str]:
    held = ["--response", str(files / "response.nc"), "--design", str(files / "design.nc")]
    return ["render", str(asked), *held, "--quiet", "--out", str(out)]


def render(files: Path, asked: Path, out: Path) -> int:
    return run_stage("film", words(files, asked, out))


def test_a_rendered_video_is_tracked_as_it_is(files: Path, tmp_path: Path) -> None:
    """With a load cell, and with all that comes beside the track."""
    out = tmp_path / "run.mp4"
    assert render(files, recording(tmp_path), out) == 0
    (tmp_path / "load.csv").write_text("s,N\n5,0\n6,10\n", encoding="utf-8")
    described = out.with_suffix(".yaml").read_text(encoding="utf-8")
    assert "synthetic: true\n" in described
    with out.with_suffix(".yaml").open("w", encoding="utf-8") as file:
        file.write(described.replace("synthetic: true\n", ""))  # the video itself says so
        file.write("load_cell: {file: load.csv, time: s, force: N, offset: 5}\n")
    tracked = [str(out.with_suffix(".yaml")), "--out", str(tmp_path / "track.nc")]
    assert run_stage("track", tracked) == 0
    made = datasets.read(tmp_path / "track.nc", "track")
    truth = datasets.read(tmp_path / "run_truth.nc", "truth")
    assert made.attrs["synthetic"] == truth.attrs["synthetic"] == "yes"
    np.testing.assert_allclose(made["time"], truth["time"], atol=1e-4)
    error = (made["displacement"] - truth["displacement"]).values
    assert np.sqrt(np.mean(error[..., :2] ** 2)) / 0.365 < 0.06
    np.testing.assert_allclose(made["load_force"], 10 * made["time"], atol=1e-3)
    lines = (tmp_path / "track.csv").read_text(encoding="utf-8").splitlines()
    assert "SYNTHETIC" in lines[0]
    assert len(lines) == 2 + made["quality"].size
    with av.open(str(out)) as video:
        assert "SYNTHETIC" in video.metadata["comment"]
        assert float(video.streams.video[0].average_rate or 0) == 20.0


def test_how_a_video_is_read_goes_over_to_its_recording(files: Path, tmp_path: Path) -> None:
    read = {"turned": "180 deg", "mirrored": True, "exposure": "1.5 ms"}
    read |= {"camera": "follows supports", "window": {"start": "0.05 s", "end": "0.2 s"}}
    agreeing = {"pixel_size": "0.365 mm", "thickness": "8 mm", "camera_distance": "1000 mm"}
    asked, out = recording(tmp_path), tmp_path / "run.mp4"
    text = yaml.safe_load(asked.read_text(encoding="utf-8")) | read | agreeing
    asked.write_text(yaml.safe_dump(text), encoding="utf-8")
    assert render(files, asked, out) == 0
    wanted, found = load_recording(asked), load_recording(out.with_suffix(".yaml"))
    for name in (*read, *agreeing):
        assert getattr(found, name) == getattr(wanted, name), name


@cases("virtual_lab", "line, key, told")
def test_what_virtual_tells_is_refused_beside_it(
    line: str, key: str, told: str, tmp_path: Path
) -> None:
    path = tmp_path / "virtual.yaml"
    path.write_text(f"virtual: {{ rate: 30 Hz }}\n{line}\n", encoding="utf-8")
    with refused(told, key, file=path):
        load_recording(path)


def test_a_log_of_many_lines_in_a_millisecond_can_be_read(files: Path, tmp_path: Path) -> None:
    asked = recording(tmp_path, load_cell={"rate": "24 kHz"})
    out = tmp_path / "load.csv"
    words = ["weigh", str(asked), "--response", str(files / "response.nc"), "--out", str(out)]
    assert run_stage("film", words) == 0
    clock = load_cell.read(out, LoadCellLog(file="load.csv")).clock
    np.testing.assert_allclose(clock, np.arange(len(clock)) / 24_000, rtol=1e-9)


@pytest.mark.parametrize(
    ("drive", "moved"),
    [
        ({"kind": "torque"}, 1.0),
        ({"kind": "rotation"}, 1.0),
        ({"drives": [{"kind": "rotation"}, {"kind": "force"}]}, 1.0),
        ({"kind": "time_series"}, 0.0),
    ],
)
def test_a_drive_that_turns_is_not_weighed(
    files: Path, tmp_path: Path, failing: Failing, drive: dict[str, object], moved: float
) -> None:
    made = datasets.read(files / "response.nc", "response")
    made["drive_displacement"] *= moved
    origin = {"problem": json.dumps({"drive": drive}), "problem_hash": "", "parents": "{}"}
    held, asked = tmp_path / "response.nc", recording(tmp_path, load_cell={})
    datasets.write(made, held, "response", origin)
    words = ["weigh", str(asked), "--response", str(held), "--out", str(tmp_path / "load.csv")]
    told = failing("film", words)
    assert all(part in told for part in (str(asked), "virtual.load_cell", "leave load_cell out"))


def test_an_axis_of_several_drives_is_refused_before_a_film(
    files: Path, tmp_path: Path, failing: Failing
) -> None:
    drives = json.dumps({"drive": {"kind": "several", "drives": [{}, {}]}})
    origin = {"problem": drives, "problem_hash": "", "parents": "{}"}
    asked, several = recording(tmp_path), shutil.copytree(files, tmp_path / "several")
    design = datasets.read(files / "design.nc", "design")
    design["support"][:] = 2  # driven
    datasets.write(design, several / "design.nc", "design", origin)
    asked.write_text(f"load_axis: driven displacement\n{asked.read_text()}", encoding="utf-8")
    told = failing("film", words(several, asked, tmp_path / "clip.mp4"))
    assert all(part in told for part in (str(asked), "load_axis: time", "2 drives act at once"))
    assert not (tmp_path / "clip.mp4").exists()


def test_a_request_is_not_written_over(files: Path, tmp_path: Path, failing: Failing) -> None:
    asked = recording(tmp_path)
    before = asked.read_bytes()
    told = failing("film", words(files, asked, asked.with_suffix(".mp4")))
    assert "would be written over" in told
    assert asked.read_bytes() == before


@pytest.mark.parametrize("ending", [".yaml", "_truth.nc"])
def test_a_film_replaces_nobodys_files(
    files: Path, tmp_path: Path, failing: Failing, ending: str
) -> None:
    kept = tmp_path / f"clip{ending}"
    kept.write_text("title: mine\n")
    told = failing("film", words(files, recording(tmp_path), tmp_path / "clip.mp4"))
    assert all(part in told for part in ("which this did not make", str(kept)))
    assert kept.read_text() == "title: mine\n"
    assert not (tmp_path / "clip.mp4").exists()


@pytest.mark.parametrize("codec", ["h264", "ffv1"])
def test_the_same_recording_gives_the_same_bytes(files: Path, tmp_path: Path, codec: str) -> None:
    asked = recording(tmp_path, end="0.1 s", codec={"name": codec})
    outs = [tmp_path / name / "run.mp4" for name in ("a", "b")]
    assert [render(files, asked, out) for out in outs] == [0, 0]
    first, second = (
        [path.read_bytes() for path in sorted(out.parent.glob("run*.[mn]*"))] for out in outs
    )
    assert len(first) == 2
    assert first == second


def test_the_specimen_rests_first_and_then_moves(film: VirtualFilm) -> None:
    assert (film.motion.pose[:3] == 0).all()
    assert (np.abs(film.motion.pose[4:]).max(axis=(1, 2)) > 0).all()
    np.testing.assert_allclose(film.motion.pose[12, 0, 2], -0.3 * 0.5, atol=1e-6)


@cases("virtual_lab", "change, told")
def test_what_cannot_be_filmed_is_refused(
    files: Path, tmp_path: Path, failing: Failing, change: dict[str, object], told: str
) -> None:
    out = tmp_path / "out/run.mp4"
    assert told in failing("film", words(files, recording(tmp_path, **change), out))
    assert not out.parent.exists()


@cases("virtual_lab", "text, key, told")
def test_a_number_that_none_can_have_is_refused(
    text: str, key: str, told: str, tmp_path: Path
) -> None:
    path = tmp_path / "virtual.yaml"
    path.write_text(text, encoding="utf-8")
    with refused(told, key, file=path):
        load_recording(path)


def test_a_plan_tells_what_to_expect(
    files: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    words = ["plan", "--response", str(files / "response.nc"), "--frames", "16"]
    words += [str(recording(tmp_path, specimen={})), "--codec", "ffv1", "h264:40"]
    with caplog.at_level(logging.INFO):
        assert run_stage("film", [*words, "--csv", str(tmp_path / "plan.csv")]) == 0
    assert "virtual.specimen is left out" in caplog.text
    with (tmp_path / "plan.csv").open(encoding="utf-8") as file:
        lossless, coarse = csv.DictReader(file)
    assert lossless["codec"] == "ffv1"
    assert float(lossless["px_per_pitch"]) == pytest.approx(41.1)
    assert 0 < float(lossless["rmse_px"]) < float(coarse["rmse_px"])
    assert lossless["lost_percent"] == "0"


def test_a_plan_without_sense_is_refused(files: Path, tmp_path: Path, failing: Failing) -> None:
    plan = ["plan", "--response", str(files / "response.nc"), "--csv", str(tmp_path / "plan.csv")]
    assert "no such codec" in failing("film", [*plan, "--codec", "vhs"])
    assert "greater than zero" in failing("film", [*plan, "--fps", "-3"])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("codec", ["h264", "ffv1"])
def test_a_damaged_video(files: Path, tmp_path: Path, codec: str, failing: Failing) -> None:
    """One bit, in whatever format; a frame that decodes to other numbers would tell nothing."""
    out = tmp_path / "run.mp4"
    assert render(files, recording(tmp_path, end="0.1 s", codec={"name": codec}), out) == 0
    content = bytearray(out.read_bytes())
    content[len(content) // 2] ^= 1
    out.write_bytes(content)
    described = out.with_suffix(".yaml")
    told = failing("track", [str(described), "--out", str(tmp_path / "track.nc")])
    assert "damaged: run.mp4 is not the video that was described" in told
    assert "key:    sha256" in told
