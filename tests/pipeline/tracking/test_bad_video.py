"""Videos as they should not be: what can be tracked of them is."""

import shlex
import struct
import subprocess
import sys
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.tracking.rendering import write_video
from pipeline.runtime import UserError
from pipeline.stages.track import readout_of
from pipeline.tracking.detect import orientation_text
from pipeline.tracking.frames import (
    Frame,
    Recording,
    TruncatedVideoError,
    check_durations,
    import_video,
    read_frames,
    read_pictures,
    video_length,
)
from pipeline.tracking.geometry import outlines_of_design
from pipeline.tracking.motion import Track, track_video, video_tracking
from pipeline.tracking.motion.unit_appearance import GLARE, HIDDEN, OUT_OF_FRAME
from pipeline.tracking.reference_frame import RecordingSetup
from tests.pipeline.tracking.conftest import CLIPS
from tests.pipeline.virtual_lab.conftest import GRID, film_of
from tests.tables import refused

SCALE = 1 / 0.365
WIDTH = 320
SPECIMEN = outlines_of_design(import_video.design(GRID))


@pytest.fixture(scope="module")
def clip() -> list[np.ndarray]:
    """The last frame at rest and three in motion."""
    return list(film_of("bare").images())[2:6]


def timed(images: list[np.ndarray]) -> Iterator[Frame]:
    return (Frame(index, index / 300, image) for index, image in enumerate(images))


def followed(shown: Iterator[Frame]) -> Track:
    return track_video(shown, SPECIMEN, SCALE)


@pytest.mark.parametrize(
    ("key", "setup"),
    [("exposure", RecordingSetup(exposure=0.05)), ("readout", RecordingSetup(readout=-0.05))],
)
def test_what_lasts_longer_than_an_interval_is_refused(
    clip: list[np.ndarray], key: str, setup: RecordingSetup
) -> None:
    """By the frames' times, as the recording's rate has them; one a little longer is rounded."""
    with refused("longer than the interval", key, "at most 3.33 ms, the frames' interval"):
        track_video(timed(clip), SPECIMEN, SCALE, setup=setup)
    rounded = RecordingSetup(exposure=0.0034)
    assert np.isfinite(track_video(timed(clip), SPECIMEN, SCALE, setup=rounded).displacement).any()


def test_what_lasts_too_long_is_told_before_all_is_tracked(clip: list[np.ndarray]) -> None:
    endless = (Frame(index, index / 300, clip[0]) for index in count())
    with refused("longer than the interval", "exposure"):
        list(check_durations(endless, {"exposure": 0.05}))
    assert next(endless).index < 100


def test_a_track_without_a_pose_is_refused(
    clip: list[np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As all are that no polynomial in time tells at their frames."""

    def told(motion: np.ndarray, sigma: np.ndarray, *_: object) -> tuple[np.ndarray, ...]:
        return motion, sigma, np.full_like(motion, np.inf)

    monkeypatch.setattr(video_tracking, "at_frame_times", told)
    with refused("no unit has a pose in any frame", remedy="exposure"):
        track_video(timed(clip), SPECIMEN, SCALE, setup=RecordingSetup(exposure=0.002))


def test_units_are_found_again_after_a_black_frame(clip: list[np.ndarray]) -> None:
    track = followed(timed([*clip[:2], np.zeros_like(clip[0]), *clip[2:]]))
    assert np.isnan(track.displacement[2]).all()
    assert (track.quality[2] != 0).all()
    assert (track.quality[3:] == 0).all()


@pytest.mark.parametrize("setup", [RecordingSetup(), RecordingSetup(thickness=3.0, distance=800.0)])
def test_units_outside_the_first_frame_have_no_poses(
    clip: list[np.ndarray], setup: RecordingSetup
) -> None:
    """They have no template; the others are tracked as ever."""
    narrow = [np.ascontiguousarray(image[:, :250]) for image in clip]
    track = track_video(timed(narrow), SPECIMEN, SCALE, setup=setup)
    outside = (track.quality == OUT_OF_FRAME).all(axis=0)
    assert outside.sum() >= 7
    assert np.isnan(track.displacement[:, outside]).all()
    assert (track.quality == 0).all(axis=0).sum() >= 35


def test_a_video_from_behind_has_the_same_motions(clip: list[np.ndarray]) -> None:
    plain = followed(timed(clip))
    mirrored = [np.ascontiguousarray(image[:, ::-1]) for image in clip]
    behind = followed(timed(mirrored))
    assert "mirrored" in orientation_text(behind.calibration.camera)
    apart = behind.displacement - plain.displacement
    assert np.sqrt(np.mean(apart[..., :2] ** 2)) / plain.calibration.pixel < 0.01


@pytest.mark.parametrize(
    ("level", "reason"), [(40.0, HIDDEN), (120.0, HIDDEN), (190.0, HIDDEN), (255.0, GLARE)]
)
def test_glare_is_told_from_what_hides_units(
    clip: list[np.ndarray], level: float, reason: int
) -> None:
    """Glare is saturated, and a hand in its light is not."""
    noise = np.random.default_rng(0).normal(0.0, 2.0, clip[0].shape)
    rows, columns = np.indices(clip[0].shape)
    covered = np.hypot(columns - 120, rows - 160) < 60
    shown = np.where(covered, level + noise, clip[1]).clip(0, 255).astype(np.uint8)
    track = followed(timed([clip[0], clip[0], shown]))
    place = track.calibration.camera.project(SPECIMEN.centre)
    under = np.hypot(*(place - [120, 160]).T) < 45
    assert under.sum() >= 4
    assert (track.quality[2, under] == reason).all()


def test_pictures_of_16_bit_in_a_folder_are_a_video(tmp_path: Path, clip: list[np.ndarray]) -> None:
    for number, image in enumerate(clip):
        path = tmp_path / f"frame{number + 8}.tif"
        assert cv2.imwrite(str(path), image.astype(np.uint16) * 257)
    read = list(read_frames(tmp_path, rate=50.0))
    assert [frame.time for frame in read] == [0.0, 0.02, 0.04, 0.06]
    np.testing.assert_allclose(read[3].image, clip[3], atol=1e-3)


@pytest.mark.parametrize(
    ("names", "times"),
    [
        (["000", "001", "004", "005"], [0.0, 1.0, 4.0, 5.0]),
        (["run2_10", "run2_20", "run2_50", "run2_60"], [0.0, 1.0, 4.0, 5.0]),
        (["f0033", "f0066", "f0100", "f0133"], [0.0, 1.0, 2.0, 3.0]),
        (["d1_t5", "d1_t9", "d2_t0", "d2_t7"], [0.0, 1.0, 2.0, 3.0]),
        (["a1", "b2", "b3", "b9"], [0.0, 1.0, 2.0, 3.0]),
        (["1", "01", "2", "5"], [0.0, 1.0, 2.0, 3.0]),
        (["a", "b", "c", "d"], [0.0, 1.0, 2.0, 3.0]),
        (["5" * 30, "5" * 29 + "6", "5" * 29 + "8", "5" * 29 + "9"], [0.0, 1.0, 3.0, 4.0]),
        (["7"], [0.0]),
    ],
)
def test_missing_numbers_are_gaps(
    tmp_path: Path, clip: list[np.ndarray], names: list[str], times: list[float]
) -> None:
    """Of the one counter in the names, if its steps are multiples of one."""
    for name, image in zip(names, clip, strict=False):
        cv2.imwrite(str(tmp_path / f"{name}.png"), image)
    read = list(read_frames(tmp_path, rate=1.0))
    assert [frame.time for frame in read] == times
    assert [frame.index for frame in read] == list(range(len(names)))
    assert video_length(tmp_path, 1.0) == times[-1] + 1.0
    late = read_frames(tmp_path, times[-1], rate=1.0)
    assert [frame.index for frame in late] == [len(names) - 1]


@pytest.mark.parametrize("bits", [10, 12, 16])
def test_pictures_keep_the_levels_of_their_camera(
    tmp_path: Path, clip: list[np.ndarray], bits: int
) -> None:
    """Of 10 or 12 bit, in 16 as they are; what a Mac leaves beside a file is no picture."""
    deep = [image.astype(np.uint16) * (2**bits // 256) for image in clip]
    for number, levels in enumerate(deep):
        assert cv2.imwrite(str(tmp_path / f"frame{number}.tif"), levels)
        (tmp_path / f"._frame{number}.tif").write_bytes(b"a fork")
    read = list(read_frames(tmp_path, rate=50.0))
    assert len(read) == len(clip)
    for frame, image in zip(read, clip, strict=True):
        np.testing.assert_allclose(frame.image, image, atol=1.0)
    dim, full = read_pictures(*(tmp_path / f"frame{number}.tif" for number in (0, 1)))
    assert np.abs(dim.astype(float) - clip[0]).max() <= 1.0
    assert np.abs(full.astype(float) - clip[1]).max() <= 1.0


@pytest.mark.parametrize("white", [1.0, 1.1, 255.0, 4095.0, 65535.0, 2e5])
def test_pictures_of_real_numbers_keep_their_levels(
    tmp_path: Path, clip: list[np.ndarray], white: float
) -> None:
    """Of whatever range, as programs for images write them; what is no number counts as black."""
    real = [image * np.float32(white / 255.0) for image in clip]
    real[-1][0, :3] = np.nan, -5.0, np.inf
    for number, levels in enumerate(real):
        assert cv2.imwrite(str(tmp_path / f"frame{number}.tif"), levels)
    read = [frame.image for frame in read_frames(tmp_path, rate=50.0)]
    brightest = max(image.max() for image in clip)
    gain = {1.1: 1.1, 2e5: 255.0 / brightest}.get(white, 1.0)
    np.testing.assert_allclose(read[1], np.minimum(gain * clip[1], 255.0), atol=0.1)
    np.testing.assert_array_equal(read[-1][0, :3], [0.0, 0.0, 255.0])


def test_faulty_folders_of_pictures_are_told(tmp_path: Path, clip: list[np.ndarray]) -> None:
    with pytest.raises(UserError, match="no pictures"):
        list(read_frames(tmp_path, rate=1.0))
    cv2.imwrite(str(tmp_path / "a1.png"), clip[0])
    cv2.imwrite(str(tmp_path / "a2.png"), clip[1][:50])
    with pytest.raises(UserError, match="no times"):
        list(read_frames(tmp_path))
    shown = read_frames(tmp_path, rate=1.0)
    next(shown)
    with pytest.raises(TruncatedVideoError, match="changes its size"):
        next(shown)
    (tmp_path / "a2.png").write_bytes(b"nothing")
    with pytest.raises(TruncatedVideoError, match=r"a2\.png cannot be read"):
        list(read_frames(tmp_path, rate=1.0))


def test_a_file_of_many_pictures_is_refused(tmp_path: Path, clip: list[np.ndarray]) -> None:
    """But not one with a preview behind the picture."""
    path = tmp_path / "a1.tif"
    assert cv2.imwritemulti(str(path), [clip[0], clip[0][::8, ::8].copy()])
    np.testing.assert_array_equal(next(read_frames(tmp_path, rate=1.0)).image, clip[0])
    assert cv2.imwritemulti(str(path), clip)
    with refused(f"{len(clip)} pictures in one file", "video", "take a1.tif away", path):
        next(read_frames(tmp_path, rate=1.0))


def test_the_remedy_for_a_file_of_many_pictures_works_as_it_is_printed(
    tmp_path: Path, clip: list[np.ndarray]
) -> None:
    path = tmp_path / "my run.tif"
    deep = [(257 * picture.astype(np.uint16)) for picture in clip]
    assert cv2.imwritemulti(str(path), deep)
    with pytest.raises(UserError) as caught:
        next(read_frames(tmp_path, rate=1.0))
    program, *words = shlex.split(str(caught.value.remedy).partition(" run: ")[2])
    assert program == sys.executable
    subprocess.run([program, *words], cwd=tmp_path, check=True)
    path.unlink()
    shown = [frame.image for frame in read_frames(tmp_path, rate=1.0)]
    np.testing.assert_allclose(shown, clip, atol=0.51)


ONE = 1 << 16


def as_held(folder: Path, matrix: tuple[int, int, int, int]) -> Path:
    """A clip whose track's header tells players (a, b, c, d) how to show it."""
    held = bytearray((CLIPS / "f_silhouette.mp4").read_bytes())
    at, (a, b, c, d) = held.index(b"tkhd") + 4 + 40, matrix  # behind version, times, ids and layer
    held[at : at + 36] = struct.pack(">9i", a, b, 0, c, d, 0, 768 * ONE, 0, 1 << 30)
    path = folder / "phone.mp4"
    path.write_bytes(held)
    return path


@pytest.mark.parametrize(
    ("matrix", "axes", "steps"),
    [
        ((0, ONE, -ONE, 0), (1, 0), (1, -1)),
        ((0, -ONE, ONE, 0), (1, 0), (-1, 1)),
        ((-ONE, 0, 0, -ONE), (0, 1), (-1, -1)),
        ((-ONE, 0, 0, ONE), (0, 1), (1, -1)),  # mirrored, as all below
        ((ONE, 0, 0, -ONE), (0, 1), (-1, 1)),
        ((0, ONE, ONE, 0), (1, 0), (1, 1)),
        ((0, -ONE, -ONE, 0), (1, 0), (-1, -1)),
    ],
)
def test_a_phone_s_video_is_turned_and_mirrored_as_players_show_it(
    tmp_path: Path,
    matrix: tuple[int, int, int, int],
    axes: tuple[int, int],
    steps: tuple[int, int],
) -> None:
    plain = next(read_frames(CLIPS / "f_silhouette.mp4")).image
    wanted = np.transpose(plain, axes)[:: steps[0], :: steps[1]]
    np.testing.assert_array_equal(next(read_frames(as_held(tmp_path, matrix))).image, wanted)


def test_readout_knows_which_row_is_shown_first(tmp_path: Path) -> None:
    given = {"video": "phone.mp4", "structure": "cloaked", "readout": "20 ms"}
    asked, source = Recording.model_validate(given), tmp_path / "phone.yaml"
    for matrix in ((0, ONE, -ONE, 0), (0, ONE, ONE, 0)):
        with refused("the camera's rows are its columns", "readout"):
            readout_of(asked, as_held(tmp_path, matrix), source)
    for across, down in ((-ONE, -ONE), (-ONE, ONE), (ONE, -ONE)):
        held = as_held(tmp_path, (across, 0, 0, down))
        assert readout_of(asked, held, source) == np.copysign(0.02, down)


def test_pictures_behind_the_window_are_not_read(tmp_path: Path, clip: list[np.ndarray]) -> None:
    for number, image in enumerate(clip):
        assert cv2.imwrite(str(tmp_path / f"a{number}.png"), image)
    (tmp_path / f"a{len(clip) - 1}.png").write_bytes(b"nothing")
    shown = list(read_frames(tmp_path, rate=10.0, end=0.1))
    assert [frame.index for frame in shown] == [0, 1]


def test_a_file_that_breaks_off_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    whole = (CLIPS / "c_rigid_lossless.mkv").read_bytes()
    broken = tmp_path / "broken.mkv"
    broken.write_bytes(whole[: len(whole) * 2 // 3])
    read: list[Frame] = []
    with pytest.raises(TruncatedVideoError, match="which are tracked") as caught:
        read.extend(read_frames(broken))
    assert 0 < len(read) < 6
    end = float(str(caught.value.remedy).split("end: ")[1].split(" s")[0])
    assert end == pytest.approx(read[-1].time, abs=0.001)
    assert list(read_frames(broken, end=end))


def test_a_clip_of_a_few_frames_is_whole(tmp_path: Path) -> None:
    images, times = [np.zeros((64, 64), np.uint8)] * 4, [0.0, 1 / 30, 2 / 30, 0.1]
    film = write_video(tmp_path / "short.mkv", images, times, "libx264", "yuv420p", 20)
    assert len(list(read_frames(film))) == 4


@pytest.mark.parametrize("error", [TruncatedVideoError("it breaks off"), KeyboardInterrupt()])
def test_what_was_tracked_before_an_end_is_kept(
    clip: list[np.ndarray], error: TruncatedVideoError | KeyboardInterrupt
) -> None:
    def shown() -> Iterator[Frame]:
        yield from timed(clip[:2])
        raise error

    track = followed(shown())
    assert track.ended is error
    assert track.displacement.shape[0] == len(track.time) == len(track.quality) == 2


def test_a_specimen_that_jumped_is_found_again(clip: list[np.ndarray]) -> None:
    """By half the distance of two units, where a neighbour is as near as the unit itself."""
    turn = cv2.getRotationMatrix2D((WIDTH / 2, WIDTH / 2), 21.0, 1.0)
    moved = turn + np.array([[0, 0, -9.0], [0, 0, 17.0]])
    jumped = cv2.warpAffine(clip[0], moved, (WIDTH, WIDTH), borderValue=205)
    track = followed(timed([clip[0], jumped]))
    camera, pose = track.calibration.camera, track.displacement[1]
    wanted = camera.project(SPECIMEN.centre) @ moved[:, :2].T + moved[:, 2]
    seen = camera.project(SPECIMEN.centre + pose[:, :2])
    inside = ((wanted > 20) & (wanted < WIDTH - 21)).all(axis=1)
    assert (track.quality[1:, inside] == 0).all()
    assert np.abs(seen - wanted)[inside].max() < 0.5


def test_a_video_cut_off_within_its_index_is_told(tmp_path: Path) -> None:
    content = (CLIPS / "f_silhouette.mp4").read_bytes()
    path = tmp_path / "cut.mp4"
    path.write_bytes(content[:-583])
    with pytest.raises(UserError, match="holds no video"):
        list(read_frames(path))
