"""Files that were written to do harm, or that were never meant to be read here."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from pipeline.problem.fields import csv_columns
from pipeline.problem.outlines import images
from pipeline.problem.reading import yaml_file
from pipeline.runtime import UserError
from pipeline.tracking.frames import video

UNSAFE = {
    "a tag": "title: !!python/object/apply:os.system ['touch pwned']",
    "a tag without its kind of value": "title: !!timestamp soon",
    "an alias": "a: &a [1, 2]\nb: *a",
    "a control character": 'title: "a\\0b"',
    "an escape sequence of terminals": 'title: "\\x1b[2J"',
    "half of a character": 'title: "\\ud800"',
    "a time out of range": "title: 2001-99-99",
    "deep nesting": "title: " + "[" * 100_000,
}


@pytest.mark.parametrize("text", UNSAFE.values(), ids=UNSAFE)
def test_only_plain_data_are_read_of_yaml(text: str, tmp_path: Path) -> None:
    path = tmp_path / "problem.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UserError) as caught:
        yaml_file.read_yaml(path)
    assert caught.value.file == str(path)
    assert not Path("pwned").exists()


SKIMMED = ("a tag", "an alias", "a time out of range", "deep nesting")
SKIM = """
import sys
from pathlib import Path
from pipeline.problem.reading import yaml_file
for path in sys.argv[1:]:
    assert yaml_file.skim_yaml(Path(path)) == {}, path
"""


def test_the_fast_reader_takes_nothing_else_either(tmp_path: Path) -> None:
    """In a process of its own: libyaml overflows its stack where nothing stops it before."""
    paths = [tmp_path / f"{name}.yaml" for name in SKIMMED]
    for path in paths:
        path.write_text(UNSAFE[path.stem], encoding="utf-8")
    subprocess.run([sys.executable, "-c", SKIM, *paths], check=True)


def test_devices_are_not_read() -> None:
    endless = Path("/dev/zero")
    with pytest.raises(UserError, match="not a plain file"):
        yaml_file.read_yaml(endless)
    with pytest.raises(UserError, match="not a plain file"):
        csv_columns.read_columns(endless, ["time"])
    with pytest.raises(UserError, match="not a plain file"):
        list(video.read_frames(endless))
    with pytest.raises(UserError, match="not a plain file"):
        images.read_outlines(endless)


def test_a_cell_without_end_is_told(tmp_path: Path) -> None:
    path = tmp_path / "load.csv"
    path.write_text(f'time,force\n0,"{"1" * 200_000}\n', encoding="utf-8")
    with pytest.raises(UserError, match="not a readable CSV") as caught:
        csv_columns.read_columns(path, ["time", "force"])
    assert caught.value.file == str(path)


def test_a_small_image_cannot_claim_all_memory(tmp_path: Path) -> None:
    path = tmp_path / "bomb.png"
    cv2.imwrite(str(path), np.zeros((1, 60_000), np.uint8))
    content = bytearray(path.read_bytes())
    content[20:24] = (60_000).to_bytes(4, "big")  # rows, in the header
    path.write_bytes(content)
    with pytest.raises(UserError, match="not a readable image"):
        images.read_outlines(path)


def test_copies_of_copies_are_not_drawn(tmp_path: Path) -> None:
    rows = ['<rect id="c0" width="9" height="9"/>']
    for level in range(1, 30):
        copies = f'<use href="#c{level - 1}"/>' * 2
        rows.append(f'<g id="c{level}">{copies}</g>')
    path = tmp_path / "void.svg"
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg">{"".join(rows)}</svg>')
    with pytest.raises(UserError, match="copies"):
        images.read_outlines(path)


@pytest.mark.parametrize("name", ["concat:a|b", "http:..example.org.a.mp4"])
def test_the_name_of_a_video_is_no_address(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path(name).write_bytes(b"no video")
    with pytest.raises(UserError, match="not a readable video"):
        list(video.read_frames(Path(name)))


def test_a_playlist_opens_no_other_files(tmp_path: Path) -> None:
    clip = Path(__file__).parents[2] / "data/tracking/b_harmonic.mp4"
    path = tmp_path / "list.m3u8"
    path.write_text(f"#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\nhttp://localhost/{clip.name}\n")
    with pytest.raises(UserError, match="not a readable video"):
        list(video.read_frames(path))
