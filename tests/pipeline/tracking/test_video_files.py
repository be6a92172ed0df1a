"""Files as cameras, phones and editors write them: what they hold, and when it was seen."""

import struct
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import numpy as np
import pytest

from pipeline.datasets import SYNTHETIC_LABEL
from pipeline.tracking.frames import (
    TruncatedVideoError,
    read_frames,
    rendered,
    video_length,
)
from tests.tables import refused

RATE = 30
FLAT = np.full((64, 64), 90, np.uint8)
PIXELS = {"mjpeg": "yuvj420p", "ffv1": "gray", "apng": "gray"}


def written(
    path: Path,
    numbers: list[int],
    codec: str = "libx264",
    rate: int = RATE,
    title: str = "",
    **options: object,
) -> Path:
    """Writes one picture at those of the instants of a rate that have these numbers."""
    ahead = {"movflags": "faststart"} if path.suffix == ".mp4" else {}
    kind = "m4v" if codec == "mpeg4" else None  # by its name, an MP4
    with av.open(str(path), "w", kind, options=ahead) as container:
        container.metadata["title"] = title
        stream = cast("av.VideoStream", container.add_stream(codec, rate=rate))
        stream.options = options
        stream.height, stream.width = FLAT.shape
        stream.pix_fmt = PIXELS.get(codec, "yuv420p")
        stream.codec_context.time_base = Fraction(1, rate)
        for number in numbers:
            frame = av.VideoFrame.from_ndarray(FLAT, format="gray")
            frame.pts, frame.time_base = number, Fraction(1, rate)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


def cut_after(path: Path, part: float) -> Path:
    """Cuts a file off behind a part of its packets, at the end of one."""
    with av.open(str(path)) as container:
        found = [(packet.pos, packet.size) for packet in container.demux(video=0)]
    with path.open("r+b") as file:
        ends = sorted(place + size for place, size in found if place is not None)
        file.truncate(ends[round(part * len(ends))])
    return path


def trimmed(path: Path, first: float, shown: float) -> Path:
    """Lets the edit list of an MP4 show so many seconds of what it holds, from one on."""
    held = bytearray(path.read_bytes())
    place = held.index(b"elst") + 12  # behind version and number of edits
    media = struct.unpack_from(">I", held, held.index(b"mdhd") + 16)[0]
    start = struct.unpack_from(">i", held, place + 4)[0] + round(first * media)
    struct.pack_into(">Ii", held, place, round(1000 * shown), start)
    path.write_bytes(held)
    return path


@pytest.mark.parametrize(("suffix", "codec"), [("mp4", "libx264"), ("avi", "mjpeg")])
def test_the_length_of_a_video_is_told_by_its_file(suffix: str, codec: str, tmp_path: Path) -> None:
    path = written(tmp_path / f"a.{suffix}", list(range(60)), codec)
    assert video_length(path) == pytest.approx(60 / RATE, abs=1 / RATE)
    assert video_length(path, 10.0) == pytest.approx(6.0)
    for number in range(5):
        (tmp_path / f"{number}.png").write_bytes(b"a picture")
    assert video_length(tmp_path, 10.0) == 0.5
    assert video_length(tmp_path) == video_length(tmp_path / "none.mp4") == np.inf


def test_dropped_frames_of_an_avi_break_nothing_off(tmp_path: Path) -> None:
    kept = [number for number in range(100) if number % 8 != 5]
    shown = list(read_frames(written(tmp_path / "a.avi", kept, "mjpeg")))
    np.testing.assert_allclose([frame.time for frame in shown], np.array(kept) / RATE)


@pytest.mark.parametrize("first", [0.0, 2.0])
def test_what_a_phone_trimmed_is_not_missed(tmp_path: Path, first: float) -> None:
    path = trimmed(written(tmp_path / "a.mp4", list(range(120))), first, 2.0)
    assert len(list(read_frames(path))) == 60


def test_a_clip_that_starts_late_is_whole(tmp_path: Path) -> None:
    path = written(tmp_path / "a.mkv", list(range(300, 330)), "ffv1")
    shown = list(read_frames(path))
    np.testing.assert_allclose([frame.time for frame in shown], np.arange(30) / RATE, atol=1e-3)


@pytest.mark.parametrize(("name", "codec"), [("a.avi", "mjpeg"), ("a.mp4", "libx264")])
@pytest.mark.parametrize("numbers", [list(range(120)), list(range(0, 120, 2))])
def test_files_that_end_between_frames_break_off(
    tmp_path: Path, name: str, codec: str, numbers: list[int]
) -> None:
    path = cut_after(written(tmp_path / name, numbers, codec), 0.6)
    with pytest.raises(TruncatedVideoError, match="should go on"):
        list(read_frames(path))


def test_the_rate_that_is_given_is_that_of_the_camera(tmp_path: Path) -> None:
    """A high-speed recording is often written to be played slowly; its window is in true time."""
    path = written(tmp_path / "a.mp4", list(range(60)))
    shown = list(read_frames(path, 0.01, 0.0295, 1000.0))
    assert [frame.index for frame in shown] == list(range(10, 30))
    np.testing.assert_allclose([frame.time for frame in shown], np.arange(10, 30) / 1000)
    cut = cut_after(path, 0.6)
    with pytest.raises(TruncatedVideoError, match="should go on") as caught:
        list(read_frames(cut, rate=1000.0))
    end = float(str(caught.value.remedy).split("end: ")[1].split(" s")[0])
    assert 0.02 < end < 0.06


ELEMENTARY_STREAMS = [
    ("a.h264", "libx264"),
    ("a.hevc", "libx265"),
    ("a.mjpeg", "mjpeg"),
    ("a.m4v", "mpeg4"),
]


@pytest.mark.parametrize(("name", "codec"), ELEMENTARY_STREAMS)
def test_a_bare_stream_has_no_times_but_by_a_rate(tmp_path: Path, name: str, codec: str) -> None:
    path = written(tmp_path / name, list(range(8)), codec)
    with refused("no times", "frame_rate", "frame_rate: '300 Hz'", path):
        list(read_frames(path))
    shown = list(read_frames(path, rate=30.0))
    np.testing.assert_allclose([frame.time for frame in shown], np.arange(8) / 30)


@pytest.mark.parametrize("codec", ["libx264", "mpeg2video"])
def test_an_interlaced_video_is_refused(tmp_path: Path, codec: str) -> None:
    """Its odd rows show another instant than the even ones."""
    path = written(tmp_path / "my a.mkv", list(range(4)), codec, flags="+ildct+ilme")
    with refused("interlaced", "video", "ffmpeg -i 'my a.mkv' -vf bwdif OUT.mp4", path):
        list(read_frames(path))


def test_stamps_too_coarse_for_the_rate_are_refused(tmp_path: Path) -> None:
    """Of several frames in a millisecond, which is what a Matroska counts."""
    path = written(tmp_path / "a.mkv", list(range(40)), "ffv1", 5000)
    with refused("most frames have the time of the one before", "frame_rate", "'300 Hz'", path):
        list(read_frames(path))
    shown = list(read_frames(path, rate=5000.0))
    np.testing.assert_allclose([frame.time for frame in shown], np.arange(40) / 5000)
    assert len(list(read_frames(written(tmp_path / "b.mkv", list(range(40)), "ffv1", 900)))) == 40


@pytest.mark.parametrize(("name", "codec"), [("a.y4m", "wrapped_avframe"), ("a.ivf", "libvpx")])
def test_files_of_lossless_tools_have_times_of_their_own(
    tmp_path: Path, name: str, codec: str
) -> None:
    shown = list(read_frames(written(tmp_path / name, list(range(8)), codec)))
    np.testing.assert_allclose([frame.time for frame in shown], np.arange(8) / RATE)


def cine(path: Path, images: list[np.ndarray], rate: int) -> Path:
    """Writes pictures as a high-speed camera's file does, its sections one after the other."""
    count, (rows, columns) = len(images), images[0].shape
    header, info, setup = 44, 40, bytearray(6000)
    struct.pack_into("<2sH", setup, 140, b"ST", len(setup))
    struct.pack_into("<I", setup, 768, rate)
    table, size = header + info + len(setup), rows * columns
    first = table + 8 * count
    places = [first + number * (8 + size) for number in range(count)]
    path.write_bytes(
        struct.pack("<2sHHHiIiI", b"CI", header, 0, 1, 0, count, 0, count)
        + struct.pack("<IIIQ", header, header + info, table, 0)
        + struct.pack("<IiiHHIIiiII", info, columns, rows, 1, 8, 0, size, 0, 0, 0, 0)
        + setup
        + struct.pack(f"<{count}Q", *places)
        + b"".join(struct.pack("<II", 8, size) + image[::-1].tobytes() for image in images)
    )
    return path


def test_a_cine_has_the_rate_at_which_it_was_taken(tmp_path: Path) -> None:
    images = [FLAT + np.arange(64, dtype=np.uint8)[:, None] + number for number in range(4)]
    shown = list(read_frames(cine(tmp_path / "a.cine", images, 5000)))
    np.testing.assert_allclose([frame.time for frame in shown], np.arange(4) / 5000)
    np.testing.assert_array_equal([frame.image for frame in shown], images)


@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("a.apng", "ffmpeg -i a.apng -c:v ffv1 a_ffv1.mkv"),
        ("my a.apng", "ffmpeg -i 'my a.apng' -c:v ffv1 'my a_ffv1.mkv'"),
        ("a.mkv", "ffmpeg -i a.mkv -c:v ffv1 a_ffv1.mkv"),  # not onto itself
    ],
)
def test_a_file_of_a_kind_that_is_not_read_is_told_so(
    tmp_path: Path, name: str, command: str
) -> None:
    path = written(tmp_path / "a.apng", [0, 1], "apng").rename(tmp_path / name)
    with refused("of this kind are not read", "video", command, path):
        list(read_frames(path))


def test_a_name_that_may_be_an_address_hides_no_label(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    named = written(tmp_path / "a.mp4", [0], title=SYNTHETIC_LABEL).rename("10:32.mp4")
    assert rendered(named)
