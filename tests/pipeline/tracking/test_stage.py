import errno
import json
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
import yaml

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.stages.track import warn_of_times
from pipeline.tracking.frames import import_video
from pipeline.tracking.motion import DROPPED, STEADY
from tests import tables
from tests.pipeline.conftest import Failing
from tests.pipeline.tracking.conftest import CLIPS
from tests.tables import cases

VIDEO = str(CLIPS / "f_silhouette.mp4")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """The bare clip, imported."""
    words = ["import", str(CLIPS / "f_silhouette.yaml"), "--out-dir", str(tmp_path)]
    assert run_stage("track", words) == 0
    return tmp_path / "f_silhouette_recording.yaml"


def test_a_recording_is_imported_whole_or_not_at_all(
    recording: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["import", str(CLIPS / "f_silhouette.yaml"), "--out-dir", str(recording.parent)]
    assert run_stage("track", words) == 0
    whole = recording.read_bytes()

    def breaks_off(path: Path, text: str, encoding: str) -> None:
        path.write_bytes(text.encode(encoding)[:20])
        raise OSError(errno.ENOSPC, "full")

    with monkeypatch.context() as full:
        full.setattr(Path, "write_text", breaks_off)
        assert run_stage("track", words) == 2
    assert "the disk is full" in capsys.readouterr().err
    assert recording.read_bytes() == whole
    assert len(list(recording.parent.iterdir())) == 2


def test_a_recording_that_was_edited_is_not_written_over(recording: Path, failing: Failing) -> None:
    extended(recording, "frame_rate: 300 Hz")
    words = ["import", str(CLIPS / "f_silhouette.yaml"), "--out-dir", str(recording.parent)]
    assert "there is a recording already" in failing("track", words)
    assert "frame_rate: 300 Hz" in recording.read_text(encoding="utf-8")


def test_an_import_replaces_no_design(recording: Path, failing: Failing) -> None:
    recording.unlink()
    design = recording.with_name("f_silhouette_design.nc")
    design.write_bytes(kept := b"of somebody")
    words = ["import", str(CLIPS / "f_silhouette.yaml"), "--out-dir", str(recording.parent)]
    assert "there is a design already" in failing("track", words)
    assert design.read_bytes() == kept


@pytest.mark.parametrize(("fps", "line"), [(2400, "frame_rate: 2400 Hz #"), (301, None)])
def test_slow_motion_keeps_the_rate_of_its_description(fps: float, line: str | None) -> None:
    """A file of 300 frames per second keeps its own times unless it was filmed at another rate."""
    described = import_video.description(CLIPS / "f_silhouette.yaml") | {"fps": fps}
    text = import_video.recording_text(described, Path(VIDEO), "design.nc")
    found = [each for each in text.splitlines() if each.startswith("frame_rate")]
    assert [each[: len(line or "")] for each in found] == ([line] if line else [])
    assert yaml.safe_load(text).get("frame_rate") == (f"{fps} Hz" if line else None)


def test_a_bare_stream_takes_the_rate_of_its_description(tmp_path: Path) -> None:
    described = import_video.description(CLIPS / "f_silhouette.yaml")
    text = import_video.recording_text(described, tmp_path / "none.h264", "design.nc")
    assert "frame_rate: 300 Hz\n" in text


def refused(recording: Path, failing: Failing) -> str:
    return failing("track", [str(recording), "--out", str(recording.with_name("track.nc"))])


def changed(recording: Path, old: str, new: str) -> None:
    text = recording.read_text(encoding="utf-8")
    assert old in text
    recording.write_text(text.replace(old, new), encoding="utf-8")


def extended(recording: Path, line: str) -> None:
    recording.write_text(recording.read_text(encoding="utf-8") + line + "\n", encoding="utf-8")


def test_a_command_finds_turned_patches(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pictures = [str(CLIPS / f"dic/rotation_{turn}.png") for turn in ("000", "170")]
    out, at = tmp_path / "motions.csv", ["256", "256", "200", "180"]
    assert run_stage("track", ["pair", *pictures, "--at", *at, "--out", str(out)]) == 0
    middle, other = np.loadtxt(out, delimiter=",", skiprows=1)[:, 2:]
    np.testing.assert_allclose(middle, [0.0, 0.0, -170.0], atol=0.02)
    np.testing.assert_allclose(other, [97.952, 160.569, -170.0], atol=0.02)
    drawing = out.with_suffix(".png")
    assert cv2.imread(str(drawing)) is not None
    table = ["pair", *pictures, "--out", str(out)]
    assert run_stage("track", [*table, "--at", "5", "5"]) == 0
    assert "warning: nothing like the patch at 5, 5" in (told := capsys.readouterr().err)
    assert "warning: warning" not in told
    for wrong, words in (
        (table, "--at X Y"),
        ([*table, "--at", "600", "9"], "outside of the picture"),
        ([*table, "--at", *at, "--out", "a.png"], "put beside it"),
        ([*table, "--at", *at, "--side", "0"], "--side"),
    ):
        assert run_stage("track", wrong) == 2
        assert words in capsys.readouterr().err
    drawing.write_bytes(Path(pictures[0]).read_bytes())
    assert run_stage("track", [*table, "--at", *at]) == 2
    assert f"{drawing}" in capsys.readouterr().err
    assert drawing.read_bytes() == Path(pictures[0]).read_bytes()


def test_a_video_is_tracked_by_two_commands(recording: Path) -> None:
    """With driven units, and a load cell on the clock of the file whatever the window."""
    path, log = recording.with_name("f_silhouette_design.nc"), recording.with_name("load.csv")
    design = datasets.read(path, "design")
    driven = design["support"].copy()
    driven[[112, 113]] = 2
    origin = {"problem": "{}", "problem_hash": "", "parents": "{}"}
    datasets.write(design.assign(support=driven), path, "design", origin)
    log.write_text("time,force\n100,0\n101,1000\n", encoding="utf-8")
    extended(recording, "window: {start: 0.005 s}\nload_cell: {file: load.csv, offset: 100}")
    extended(recording, "load_axis: driven displacement")
    out = recording.with_name("track.nc")
    assert run_stage("track", [str(recording), "--out", str(out), "--no-report"]) == 0
    made = datasets.read(out, "track")
    assert made["displacement"].dims == ("time", "unit", "dof")
    np.testing.assert_array_equal(made["unit"], design["unit"])
    np.testing.assert_allclose(np.diff(made["time"]), 1 / 300, atol=1e-6)
    assert (made["quality"] == 0).all()
    assert made.attrs["synthetic"] == "yes"
    assert made["frame"].values[0] == 2
    np.testing.assert_allclose(made["load_force"], 1000 * made["frame"] / 300, atol=0.02)
    mean = made["displacement"].isel(unit=[112, 113], dof=[0, 1]).mean("unit")
    np.testing.assert_allclose(made["drive_displacement"], mean.values, atol=1e-9)
    assert "drive_displacement" in made.coords


def test_drives_at_once_have_no_common_displacement(recording: Path, failing: Failing) -> None:
    path = recording.with_name("f_silhouette_design.nc")
    design = datasets.read(path, "design")
    driven = design["support"].copy()
    driven[[112, 113]] = 2
    drives = json.dumps({"drive": {"kind": "several", "drives": [{}, {}]}})
    origin = {"problem": drives, "problem_hash": "", "parents": "{}"}
    datasets.write(design.assign(support=driven), path, "design", origin)
    extended(recording, "load_axis: driven displacement")
    words = refused(recording, failing)
    assert "2 drives act at once" in words
    assert "load_axis: time" in words


@cases("tracking", "old, new, told")
def test_another_design_is_refused(
    recording: Path, failing: Failing, old: str, new: str, told: str
) -> None:
    other = recording.with_name("other.yaml")
    other.write_bytes((CLIPS / "f_silhouette.yaml").read_bytes())
    changed(other, old, new)
    folder = str(recording.parent)
    assert run_stage("track", ["import", str(other), "--video", VIDEO, "--out-dir", folder]) == 0
    words = refused(recording, failing)
    assert "does not show this design" in words
    assert told in words


@pytest.mark.slow
def test_a_turned_lattice_is_as_told(recording: Path) -> None:
    text = recording.read_text(encoding="utf-8")
    made, out = [], recording.with_name("track.nc")
    for turned in ("turned: 0 deg", "turned: 180 deg"):
        recording.write_text(f"{text}{turned}\n", encoding="utf-8")
        assert run_stage("track", [str(recording), "--out", str(out), "--no-report"]) == 0
        made.append(datasets.read(out, "track"))
    upright, turned_by_half = (each["displacement"].values for each in made)
    assert np.abs(upright[-1, :, :2]).max() > 0.05
    np.testing.assert_allclose(turned_by_half[:, ::-1, :2], -upright[..., :2], atol=0.01)


@pytest.mark.parametrize(("offset", "window"), [(70, ""), (-9, ""), (-0.5, "{end: 0.4 s}")])
def test_a_log_of_another_time_is_refused_before_the_tracking(
    recording: Path, failing: Failing, offset: float, window: str
) -> None:
    recording.with_name("load.csv").write_text("time,force\n0,0\n1,5\n", encoding="utf-8")
    extended(recording, f"load_cell: {{file: load.csv, offset: {offset}}}")
    if window:
        extended(recording, f"frame_rate: 10 Hz\nwindow: {window}")
    words = refused(recording, failing)
    assert "do not overlap" in words
    assert "units;" not in words


def test_the_track_of_a_video_that_breaks_off_is_kept(tmp_path: Path, failing: Failing) -> None:
    """Under a name that is no output of a rule: what a failed one was to make is deleted."""
    whole = (CLIPS / "c_rigid_lossless.mkv").read_bytes()
    broken = tmp_path / "broken.mkv"
    broken.write_bytes(whole[: len(whole) * 2 // 3])
    described = str(CLIPS / "c_rigid_lossless.yaml")
    words = ["import", described, "--video", str(broken), "--out-dir", str(tmp_path)]
    assert run_stage("track", words) == 0
    told = refused(tmp_path / "broken_recording.yaml", failing)
    kept = tmp_path / "track_partial.nc"
    assert f"are kept in {kept}" in told
    assert "breaks off after" in told
    frames = datasets.read(kept, "track").sizes["time"]
    assert f"the {frames} frames until then" in told
    assert kept.with_suffix(".csv").is_file()
    assert not list(tmp_path.glob("track.*"))


@pytest.mark.parametrize("name", ["track.csv", "track_partial.csv"])
def test_a_log_beside_the_track_is_refused_before_the_tracking(
    recording: Path, failing: Failing, name: str
) -> None:
    log = recording.with_name(name)
    log.write_text("time,force\n0,0\n", encoding="utf-8")
    words = refused(recording, failing)
    assert f"file:   {log}" in words
    assert "units;" not in words
    assert log.read_text(encoding="utf-8") == "time,force\n0,0\n"
    assert not recording.with_name("track.nc").exists()


@pytest.mark.parametrize(
    ("name", "stamps", "told"),
    [
        ("v.mp4", [0, 1, 2, 3, 4, 5], "by the motion, frames were dropped in 2 gaps"),
        ("v.mp4", [0, 1, 2, 6, 7, 8], "the frame rate varies"),
        ("pictures", [0, 1, 2, 6, 7, 8], "numbers are missing"),
        ("v.mp4", [0, 1, 2, 3, 4, 5], ""),
    ],
)
def test_gaps_in_time_are_told(
    name: str, stamps: list[int], told: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Those that only the motion tells make later times wrong."""
    (tmp_path / "pictures").mkdir()
    timing = np.where(np.isin(np.arange(6), [3, 5]), DROPPED if told else STEADY, STEADY)
    warn_of_times(np.array(stamps) / 30, timing, tmp_path / name)
    assert [line[: len(told)] for line in caplog.messages] == ([told] if told else [])


@cases("tracking", "changes, key, what")
def test_a_grid_without_sense_is_refused(
    changes: dict[str, object], key: str, what: str, tmp_path: Path, failing: Failing
) -> None:
    content = yaml.safe_load((CLIPS / "f_silhouette.yaml").read_bytes())
    path = tmp_path / "run.yaml"
    path.write_text(yaml.safe_dump(content | changes), encoding="utf-8")
    words = failing("track", ["import", str(path), "--video", VIDEO, "--out-dir", str(tmp_path)])
    assert what in words
    assert f"key:    {key}\n" in words
    assert str(path) in words


@cases("tracking", "old, new, told")
def test_what_cannot_be_tracked_is_refused(
    recording: Path, failing: Failing, old: str, new: str, told: str
) -> None:
    with av.open(str(recording.with_name("black.mkv")), "w") as container:
        stream = container.add_stream("ffv1", rate=10)
        stream.width, stream.height, stream.pix_fmt = 320, 240, "gray"
        frame = av.VideoFrame.from_ndarray(np.zeros((240, 320), np.uint8), format="gray")
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    if old:
        changed(recording, old.replace("VIDEO", VIDEO), new)
    else:
        extended(recording, new)
    words = refused(recording, failing)
    assert told in words
    assert "units;" not in words  # before tracking


@cases("tracking", "words, told")
def test_what_a_command_lacks_is_told(words: list[str], told: str, failing: Failing) -> None:
    assert told in failing("track", words)


@pytest.mark.parametrize("name", ["IMG.MOV", "IMG.MP4", "IMG.cine", "IMG.webm", "IMG"])
def test_a_video_beside_its_description_is_found_whatever_its_kind(
    tmp_path: Path, name: str
) -> None:
    (tmp_path / name).touch()
    (tmp_path / "IMG_2.mp4").touch()
    assert import_video.video_of(tmp_path / "IMG.yaml") == tmp_path / name


def test_a_folder_without_pictures_is_no_video(tmp_path: Path) -> None:
    """Files of an import lie in a folder of the video's name."""
    folder = tmp_path / "phone"
    folder.mkdir()
    (folder / "phone_design.nc").touch()
    with tables.refused("no video beside it", remedy="--video"):
        import_video.video_of(tmp_path / "phone.yaml")
    (folder / "0001.PNG").touch()
    assert import_video.video_of(tmp_path / "phone.yaml") == folder


@pytest.mark.parametrize("comment", [None, "SYNTHETIC"])
def test_an_imported_video_is_synthetic_as_told(comment: str | None, tmp_path: Path) -> None:
    lines = (CLIPS / "f_silhouette.yaml").read_text(encoding="utf-8").splitlines()
    told = [line for line in lines if not line.startswith("synthetic")]
    (tmp_path / "run.yaml").write_text("\n".join(told), encoding="utf-8")
    with av.open(VIDEO) as clip, av.open(str(tmp_path / "run.mp4"), "w") as copy:
        copy.metadata.update({} if comment is None else {"comment": comment})
        stream = copy.add_stream_from_template(clip.streams.video[0])
        for packet in clip.demux(video=0):
            if packet.dts is not None:
                packet.stream = stream
                copy.mux(packet)
    words = ["import", str(tmp_path / "run.yaml"), "--out-dir", str(tmp_path)]
    assert run_stage("track", words) == 0
    made = (tmp_path / "run_recording.yaml").read_text(encoding="utf-8")
    assert f"synthetic: {str(comment is not None).lower()}\n" in made
