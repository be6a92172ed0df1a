import json
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
import xarray as xr

from pipeline import datasets
from pipeline.datasets import provenance
from pipeline.tracking.frames import Frame, import_video
from pipeline.tracking.motion import median_uncertainty
from reports.__main__ import main
from reports.products.tracking import advice, figure, overlay, track_quality
from reports.products.tracking.track_quality import ExposureStatistics, StreamProperties
from tests.reports.conftest import Failing

NOISE = np.array([0.02, 0.02, 0.001])
PIXEL = 0.5
FRAMES, RESTING, LOST = 30, 12, 7


@pytest.fixture
def track() -> xr.Dataset:
    """Five by five units: at rest with noise, then carried along; unit 7 is hidden in the end."""
    grid = {"name": "g", "grid": [5, 5], "spacing_mm": 15.0, "ligament_gap_mm": 2.3}
    design = import_video.design(grid | {"bias_angle_deg": 20.0})
    random = np.random.default_rng(2)
    pose = NOISE * random.normal(size=(FRAMES, 25, 3))
    pose[RESTING:, :, 0] += 0.4 * np.arange(1, FRAMES - RESTING + 1)[:, None]
    quality = np.zeros((FRAMES, 25), np.int8)
    pose[-5:, LOST], quality[-5:, LOST] = np.nan, 2
    sigma = np.where(np.isfinite(pose), NOISE, np.nan)
    timing = np.zeros(FRAMES, np.int8)
    timing[20] = 1
    motion = ("time", "unit", "dof")
    return xr.Dataset(
        {
            "vertices": design["vertices"],
            "displacement": (motion, pose),
            "sigma": (motion, sigma),
            "quality": (motion[:2], quality),
            "timing": (motion[:1], timing),
            "frame": (motion[:1], np.arange(FRAMES)),
            "load_force": (motion[:1], np.full(FRAMES, np.nan)),
            "camera_homography": (
                ("row", "column"),
                np.array([[1 / PIXEL, 0, 20], [0, -1 / PIXEL, 150], [0, 0, 1]]),
            ),
            "camera_centre": (("xy",), [80.0, 80.0]),
            "camera_radial": (("power",), [0.0, 0.0]),
            "camera_residual": (("unit", "xy"), 0.1 * random.normal(size=(25, 2))),
            "image_size": (("xy",), [176, 176]),
            "blur": ((), 0.8),
        },
        {
            **{name: design[name] for name in ("unit", "i", "j", "xy")},
            "drive_displacement": (("time", "xy"), np.full((FRAMES, 2), np.nan)),
            "time": (motion[:1], np.arange(FRAMES) / 10),
            "dof": (motion[2:], ["ux", "uy", "theta"]),
        },
        {
            "recording": '{"title": "Known", "video": "v.mkv", "synthetic": true}',
            "synthetic": "yes",
        },
    )


def grey(level: int = 120) -> np.ndarray:
    image = np.full((176, 176), level, np.uint8)
    image[::2] = 20
    return image


def of(track: xr.Dataset, alone: float = 1.0) -> track_quality.TrackQuality:
    return track_quality.measured(track, [grey(230)] * 3, StreamProperties("ffv1", alone))


def test_measures_are_those_of_the_track(track: xr.Dataset) -> None:
    found = of(track)
    assert found.pixel == pytest.approx(PIXEL)
    assert found.pitch == pytest.approx(30.0)
    assert found.resting == RESTING
    np.testing.assert_allclose(found.floor, NOISE * [2, 2, 180 / np.pi], rtol=0.15)
    np.testing.assert_allclose(found.sigma, NOISE * [2, 2, 180 / np.pi])
    assert found.lost[-1, found.reasons.index("hidden")] == 1 / 25
    assert found.lost[:-5].sum() == 0
    assert (found.duplicates, found.dropped) == ([20], [])
    assert found.fastest == pytest.approx(0.8, rel=0.3)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"light": ExposureStatistics(0.3, 0.1, 0.0, 0.0)}, "more light"),
        ({"light": ExposureStatistics(1.0, 0.1, 0.2, 0.0)}, "shorter exposure"),
        ({"light": ExposureStatistics(0.9, 0.1, 0.0, 0.2)}, "flicker"),
        ({"blur": 3.0}, "focus"),
        ({"pitch": 14.0}, "larger dots"),
        ({"stream": StreamProperties("h264", 0.01)}, "intra codec"),
        ({"irregular": 0.4}, "constant frame rate"),
        ({"fastest": 3.0}, "10 % of the interval"),
        ({"floor": np.full(3, np.nan)}, "at rest"),
    ],
)
def test_advice_names_what_is_wrong(track: xr.Dataset, change: dict[str, Any], told: str) -> None:
    lost = np.zeros((FRAMES, 5))
    good = of(track)._replace(lost=lost, duplicates=[], fastest=0.1, pitch=40.0)
    assert "Nothing to improve" in advice.advice(good)[0]
    (line,) = advice.advice(good._replace(**change))
    assert told in line
    first, second, *_ = advice.advice(of(track))  # what is lost and repeated comes first
    assert "hidden" in first
    assert "Gaps where frames were dropped: 0; repeated frames: 1." in second


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({}, "compare the design"),
        ({"fastest": 6.0}, "expose more briefly, since units move by up to 6.0 px"),
        ({"blur": 2.0}, "focus, since edges are blurred by 2.0 px"),
        ({"light": ExposureStatistics(0.6, 0.4, 0.0, 0.0)}, "more light"),
    ],
)
def test_causes_of_a_poor_fit(track: xr.Dataset, change: dict[str, Any], told: str) -> None:
    found = of(track)._replace(fastest=0.1)
    lost = np.where(np.array(found.reasons) == "poor_fit", 0.02, 0.0) * np.ones((FRAMES, 1))
    first, *_ = advice.advice(found._replace(lost=lost, **change))
    assert "poor fit" in first
    assert told in first
    assert ("focus" in first) == ("blur" in change)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_unit_that_is_never_seen_and_a_frame_without_any_are_drawn(track: xr.Dataset) -> None:
    for name in ("displacement", "sigma"):
        track[name][:, LOST] = np.nan
        track[name][-1] = np.nan
    track["quality"][:, LOST], track["quality"][-1] = 2, 2
    found = of(track)
    assert found.resting == RESTING
    assert np.isfinite(found.sigma).all()
    drawn = figure.draw_quality(track, found, "time")
    shown: Any = drawn.axes[2].collections[0].get_array()
    assert np.ma.getmaskarray(shown)[LOST]


def test_units_are_coloured_and_lost_ones_hatched(track: xr.Dataset) -> None:
    frames = [Frame(k, k / 10, grey()) for k in range(FRAMES)]
    drawn = list(overlay.images(overlay.painter(track, "displacement"), frames))
    assert len(drawn) == FRAMES
    lost = np.array(overlay.painter(track, "rotation").camera.project(np.array([30.0, 15.0])))
    around = [image[_about(2 * lost)] for image in (drawn[0], drawn[-1])]
    orange = [(area == (224, 123, 0)).all(axis=-1).sum() for area in around]
    assert orange[0] == 0
    assert orange[1] > 20
    assert (drawn[-1][_about(2 * lost)] != drawn[0][_about(2 * lost)]).any()


def test_ids_are_light_on_dark_units_and_dark_on_light_ones(track: xr.Dataset) -> None:
    painted = overlay.painter(track, "displacement")
    place = painted.camera.project(painted.specimen.centre[12] + painted.pose[0, 12, :2])
    light, dark = (
        next(overlay.images(shown, [Frame(0, 0.0, grey())]))[_about(2 * place + 0.5)].mean(axis=-1)
        for shown in (painted, painted._replace(values=np.full_like(painted.values, 1e3)))
    )
    strokes = light < 60
    assert strokes.sum() > 10
    assert np.median(dark[strokes]) > 200


def test_a_frame_is_called_by_its_number_in_the_file(track: xr.Dataset) -> None:
    painted = overlay.painter(track, "displacement")
    first, later = (
        next(overlay.images(painted, [Frame(number, 0.0, grey())])) for number in (0, 40)
    )
    assert (first != later).any()


def _about(place: np.ndarray) -> tuple[slice, slice]:
    column, row = np.round(place).astype(int)
    return slice(row - 12, row + 12), slice(column - 12, column + 12)


def filmed(track: xr.Dataset, folder: Path) -> list[str]:
    """Writes a track and its video, and returns the options that name them."""
    with av.open(str(folder / "v.mkv"), "w") as container:
        stream = container.add_stream("ffv1", rate=10)
        stream.width = stream.height = 176
        stream.pix_fmt = "gray"
        for _ in range(track.sizes["time"]):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(grey(), format="gray")))
        container.mux(stream.encode(None))
    origin = {"parents": json.dumps({"video": provenance.file_hash(folder / "v.mkv")})}
    datasets.write(track, folder / "track.nc", "track", origin)
    return ["--track", str(folder / "track.nc"), "--video", str(folder / "v.mkv")]


def test_a_name_that_may_be_an_address_is_read_as_a_file(
    track: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    filmed(track, tmp_path)
    monkeypatch.chdir(tmp_path)
    named = Path("v.mkv").rename("10:32.mkv")
    assert track_quality.stream_of(named).codec == "ffv1"


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("frames", [1, 6])
def test_a_page_of_frames_without_intervals_is_made(
    track: xr.Dataset, tmp_path: Path, frames: int
) -> None:
    """Of one frame, or of several that have one time."""
    short = track.isel(time=slice(frames))
    words = filmed(short.assign_coords(time=np.zeros(frames)), tmp_path)
    assert main(["tracking", *words, "--out-dir", str(tmp_path / "page"), "--quiet"]) == 0
    page = (tmp_path / "page/index.html").read_text(encoding="utf-8")
    assert "rate not known, 176 × 176 px" in page
    assert "nan" not in page.split("<svg")[0]
    with av.open(str(tmp_path / "page/overlay.mp4")) as shown:
        assert sum(1 for _ in shown.decode(video=0)) == frames


def test_the_page_states_the_uncertainty_that_tracking_tells(
    track: xr.Dataset, tmp_path: Path
) -> None:
    track["sigma"] = track["sigma"] * xr.DataArray([0.5, 2.5, 1.0], dims="dof")
    place, turn = median_uncertainty(track["sigma"].values)
    assert place == pytest.approx(0.02 * np.sqrt((0.5**2 + 2.5**2) / 2))
    words = filmed(track, tmp_path)
    assert main(["tracking", *words, "--out-dir", str(tmp_path / "page"), "--quiet"]) == 0
    told = (tmp_path / "page/index.html").read_text(encoding="utf-8")
    assert f"{1000 * place:.2g} µm, root mean square of x and y" in told
    assert f"{np.rad2deg(turn):.3f} deg" in told


def test_the_page_says_synthetic_and_is_the_same_twice(track: xr.Dataset, tmp_path: Path) -> None:
    words, made = filmed(track, tmp_path), []
    for name in ("first", "second"):
        assert main(["tracking", *words, "--out-dir", str(tmp_path / name), "--quiet"]) == 0
        folder = tmp_path / name
        made.append([(folder / file).read_bytes() for file in ("index.html", "overlay.mp4")])
    assert made[0] == made[1]
    assert made[0][0].decode().count("SYNTHETIC") >= 2
    with av.open(str(tmp_path / "first/overlay.mp4")) as shown:
        assert "SYNTHETIC" in shown.metadata["comment"]
        assert sum(1 for _ in shown.decode(video=0)) == FRAMES


def test_another_video_is_refused(track: xr.Dataset, tmp_path: Path, failing: Failing) -> None:
    datasets.write(track, tmp_path / "track.nc", "track", {"parents": '{"video": "abc"}'})
    (tmp_path / "v.mkv").write_bytes(b"another")
    words = ["--track", tmp_path / "track.nc", "--video", tmp_path / "v.mkv"]
    assert "that of another video" in failing("tracking", tmp_path / "report", *words)
