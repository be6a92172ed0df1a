"""Videos are written whole, frame by frame in order, or not at all."""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import av
import numpy as np
import pytest

from pipeline.problem.sections import Codec
from pipeline.virtual_lab import encode_video, video_writer
from sim.core import Image

SHADES = np.arange(240, 20, -10)


def greys() -> Iterator[Image]:
    """Each in a shade of its own; one array for all, as of a reader that uses its memory again."""
    image = np.empty((32, 48), np.uint8)
    for shade in SHADES:
        image[:] = shade
        yield image


@pytest.mark.parametrize("codec", [Codec(name="ffv1"), Codec(name="h264", crf=1)])
def test_all_frames_come_in_order(tmp_path: Path, codec: Codec) -> None:
    path = tmp_path / f"film{codec.suffixes[0]}"
    encode_video(path, greys(), 30.0, codec, {})
    with av.open(path) as container:
        frames = [frame.to_ndarray(format="gray") for frame in container.decode(video=0)]
    assert [float(frame.mean()) for frame in frames] == pytest.approx(SHADES.tolist(), abs=2.0)


def test_nothing_is_left_of_a_video_whose_frames_break_off(tmp_path: Path) -> None:
    def broken() -> Iterator[Image]:
        yield from islice(greys(), 12)
        raise RuntimeError("no light")

    with pytest.raises(RuntimeError, match="no light"):
        encode_video(tmp_path / "film.mkv", broken(), 30.0, Codec(name="ffv1"), {})
    assert not list(tmp_path.iterdir())


def test_an_error_of_the_encoder_ends_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Image] = []

    def seen() -> Iterator[Image]:
        for image in greys():
            made.append(image)
            yield image

    def refuse(*_: object) -> None:
        raise RuntimeError("no room")

    monkeypatch.setattr(video_writer, "_encode", refuse)
    with pytest.raises(RuntimeError, match="no room"):
        encode_video(tmp_path / "film.mkv", seen(), 30.0, Codec(name="ffv1"), {})
    assert len(made) < len(SHADES)  # and no more are made for it
    assert not list(tmp_path.iterdir())
