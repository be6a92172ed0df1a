from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

from pipeline import datasets
from pipeline.problem.sections import VirtualRecording
from pipeline.tracking.frames import Frame, read_frames
from pipeline.tracking.motion import Track, track_video
from pipeline.tracking.reference_frame import RecordingSetup
from pipeline.virtual_lab import prepare_film, select_case
from pipeline.virtual_lab.face_marks import FaceMarks
from pipeline.virtual_lab.filming import VirtualFilm
from tests.pipeline.virtual_lab.conftest import SETUP, film_of
from tests.tables import cases, some

DARK, LIGHT = 0.05, 0.8


def filmed(specimen: str, **look: float) -> VirtualFilm:
    """Four frames, thin units: faces, marks and board of the shades that are given."""
    return film_of(specimen, rate="3 Hz", look={"thickness": "0 mm", **look})


def shown(film: VirtualFilm) -> Iterator[Frame]:
    for index, image in enumerate(film.images()):
        yield Frame(index, index / 3, image)


def check(film: VirtualFilm, track: Track, bar: float = 0.03) -> None:
    assert (track.quality == 0).all()
    error = track.displacement - film.motion.pose
    assert np.sqrt(np.mean(error[..., :2] ** 2)) / track.calibration.pixel < bar
    assert np.rad2deg(np.sqrt(np.mean(error[..., 2] ** 2))) < 0.15


@pytest.mark.parametrize("thickness", [0.0, 8.0])
def test_an_exposure_that_is_not_allowed_for_is_told(
    thickness: float, caplog: pytest.LogCaptureFixture
) -> None:
    """Templates that side walls change are not blurred as well."""
    film = film_of("bare", rate="3 Hz", look={"thickness": f"{thickness} mm"})
    setup = RecordingSetup(thickness, film.scene.view.eye[2], exposure=0.001)
    track_video(shown(film), film.scene.specimen, 1 / 0.365, setup=setup)
    assert ("side walls show: the blur of quick motions" in caplog.text) == (thickness > 0.0)


@cases("virtual_lab", "specimen, look")
def test_shades_of_faces_marks_and_board(specimen: str, look: dict[str, float]) -> None:
    film = filmed(specimen, **look)
    check(film, track_video(shown(film), film.scene.specimen, 1 / 0.365))


@pytest.mark.parametrize(("specimen", "bar"), [("bare", 0.03), ("dots", 0.08)])
def test_units_turn_about_their_own_middles(specimen: str, bar: float) -> None:
    """Bare ones, assembled off their places; and those in their places, with faces glued on askew.

    The places of the latter are known no better than the camera, which such faces bend a little.
    """
    film = filmed(specimen)
    units, marks = film.scene.specimen, film.scene.marks
    off = np.where(np.arange(units.count) % 2, 1.0, -1.0)[:, None] * [0.3, 0.2]
    if specimen == "bare":
        made = replace(units, centre=units.centre + off)
    else:
        made = replace(units, outline=units.outline + off[:, None])
        marks = marks._replace(centre=marks.centre + off[marks.unit])
    film = film._replace(scene=film.scene._replace(specimen=made, marks=marks))
    check(film, track_video(shown(film), units, 1 / 0.365), bar)


def test_units_that_are_marked_in_different_ways() -> None:
    kinds = [filmed(kind).scene.marks for kind in ("dots", "speckle", "bare")]
    film = filmed("bare")
    parts = [
        FaceMarks(*(values[marks.unit % 3 == kind] for values in marks))
        for kind, marks in enumerate(kinds)
    ]
    mixed = FaceMarks(*(np.concatenate(values) for values in zip(*parts, strict=True)))
    film = film._replace(scene=film.scene._replace(marks=mixed))
    check(film, track_video(shown(film), film.scene.specimen, 1 / 0.365))


def test_polygons_with_other_numbers_of_corners(files: Path) -> None:
    """Every third unit is a triangle, every seventh is not there."""
    held = datasets.read(files / "response.nc", "response")
    vertices = held["vertices"].values.copy()
    vertices[:, 1::3, 3] = np.nan
    vertices[:, 4::7] = np.nan
    corners = vertices[0][held["ligament_unit"].values, held["ligament_vertex"].values]
    whole = held.assign(vertices=(held["vertices"].dims, vertices))
    kept = whole.isel(ligament=np.isfinite(corners).all(axis=(1, 2)))
    asked: dict[str, Any] = {**SETUP, "rate": "3 Hz", "look": {"thickness": "0 mm"}}
    film = prepare_film(
        select_case(kept, "cloaked", 0), "cloaked", "bare", VirtualRecording.model_validate(asked)
    )
    assert film.scene.specimen.count == 42
    check(film, track_video(shown(film), film.scene.specimen, 1 / 0.365))


@pytest.mark.parametrize(
    ("codec", "layout", "suffix"),
    some(
        [
            ("ffv1", "gray16le", ".mkv"),
            ("mjpeg", "yuvj444p", ".avi"),
            ("libx265", "yuv420p", ".mp4"),
        ],
        1,
    ),
)
def test_files_of_other_layouts(tmp_path: Path, codec: str, layout: str, suffix: str) -> None:
    film = filmed("dots")
    stamps = [0, 30, 90, 120]
    video = tmp_path / f"clip{suffix}"
    with av.open(str(video), "w") as container:
        stream = container.add_stream(codec, rate=30)
        assert isinstance(stream, av.VideoStream)
        stream.height, stream.width = film.scene.view.camera.size[::-1]
        stream.pix_fmt = layout
        stream.codec_context.time_base = Fraction(1, 30)
        stream.options = {"crf": "8", "x265-params": "log-level=none"}
        stream.bit_rate = 80_000_000
        for stamp, image in zip(stamps, film.images(), strict=True):
            tinted = np.stack([image, image, (0.8 * image).astype(np.uint8)], axis=-1)
            frame = av.VideoFrame.from_ndarray(tinted, format="rgb24").reformat(format=layout)
            frame.pts, frame.time_base = stamp, Fraction(1, 30)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    track = track_video(read_frames(video), film.scene.specimen, 1 / 0.365)
    np.testing.assert_allclose(track.time, np.array(stamps) / 30, atol=0.002)
    check(film, track)
