import os
import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from pipeline.problem.fields import csv_columns
from pipeline.problem.outlines import find_inside, images
from pipeline.problem.reading import yaml_file
from pipeline.runtime import UserError, read_bounded
from pipeline.tracking.frames import video
from tests.tables import refused

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


TWO_WAYS = ["3:0", "0036", "-012", "1_000", "190:20:30", "0b11", "0o17", "2024-01-02", "1:30.5"]


@pytest.mark.parametrize("word", TWO_WAYS)
def test_what_reads_in_two_ways_is_refused(word: str, tmp_path: Path) -> None:
    """YAML 1.1 and 1.2 differ: 3:0 is 180 or a text, 0036 is 30 or 36."""
    path = tmp_path / "problem.yaml"
    for text in (f"a: {word}", f"a: [{word}]", f"{word}: a"):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(UserError, match="reads in two ways") as caught:
            yaml_file.read_yaml(path)
        assert caught.value.line == 1
    path.write_text(f"a: '{word}'", encoding="utf-8")
    assert yaml_file.read_yaml(path).data == {"a": word}


def test_words_are_those_of_yaml_1_2(tmp_path: Path) -> None:
    path = tmp_path / "problem.yaml"
    path.write_text("a: [yes, no, on, off, true, False, 36, 0, 0.5, -3, 0x1F, 1e3, ~]")
    wanted = ["yes", "no", "on", "off", True, False, 36, 0, 0.5, -3, 31, "1e3", None]
    assert yaml_file.read_yaml(path).data == {"a": wanted}
    path.write_text("a: {<<: {b: 1}}")
    with pytest.raises(UserError, match="merging"):
        yaml_file.read_yaml(path)


SKIMMED = ("a tag", "an alias", "a time out of range", "deep nesting")
SKIM = """
import pathlib, sys
from pipeline.problem.reading import yaml_file
for path in sys.argv[1:]:
    assert yaml_file.read_quickly(pathlib.Path(path)) == {}, path
"""


def test_the_fast_reader_takes_nothing_else_either(tmp_path: Path) -> None:
    """In a process of its own: libyaml overflows its stack where nothing stops it before."""
    paths = [tmp_path / f"{name}.yaml" for name in SKIMMED]
    for path in paths:
        path.write_text(UNSAFE[path.stem], encoding="utf-8")
    subprocess.run([sys.executable, "-c", SKIM, *paths], check=True)


READERS: tuple[Callable[[Path], object], ...] = (
    yaml_file.read_yaml,
    images.read_outlines,
    lambda path: csv_columns.read_columns(path, ["time"]),
    lambda path: list(video.read_frames(path)),
)


@pytest.mark.parametrize("read", READERS)
def test_devices_are_not_read(read: Callable[[Path], object]) -> None:
    with refused("not a plain file"):
        read(Path("/dev/zero"))


def test_small_files_cannot_claim_all_memory(tmp_path: Path) -> None:
    path = tmp_path / "bomb.png"
    cv2.imwrite(str(path), np.zeros((1, 60_000), np.uint8))
    content = bytearray(path.read_bytes())
    content[20:24] = (60_000).to_bytes(4, "big")  # rows, in the header
    path.write_bytes(content)
    with pytest.raises(UserError, match="not a readable image"):
        images.read_outlines(path)
    path = tmp_path / "load.csv"
    path.write_text(f'time,force\n0,"{"1" * 200_000}\n', encoding="utf-8")
    with pytest.raises(UserError, match="not a readable CSV") as caught:
        csv_columns.read_columns(path, ["time", "force"])
    assert caught.value.file == str(path)


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
def test_a_video_is_no_address(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_a_video_that_cannot_be_read_is_to_be_mended_without_other_tools(tmp_path: Path) -> None:
    path = tmp_path / "clip.mp4"
    path.write_bytes(b"no video")
    with pytest.raises(UserError, match="not a readable video") as caught:
        list(video.read_frames(path))
    assert "save it" in str(caught.value.remedy)
    assert "ffprobe" not in str(caught.value)


SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9">{}</svg>'
TRIANGLE = '<path d="M0 0 L9 0 L9 9 Z"/>'
HOSTILE = {
    "an arc of no radius": '<path d="M1,1 A1e-300,1e-300 0 0 1 5,5 Z"/>',
    "groups in groups": "<g>" * 100_000 + TRIANGLE + "</g>" * 100_000,
    "many curves": f'<path d="M0,0{"C1,2 3,4 5,6" * 30_000}Z"/>',
    "many paths": TRIANGLE * 30_000,
    "no size": f'<g transform="scale(1e-300)">{TRIANGLE}</g>',
    "no course": TRIANGLE.replace("d=", "e="),
    "no end": '<path d="M0 0 L1e400 1 L1 0 Z"/>',
}


@pytest.mark.parametrize("content", HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_drawing_is_one_message(content: str, tmp_path: Path) -> None:
    path = tmp_path / "void.svg"
    for ground in ("", '<path fill="#fff" d="M1 1 H3 V3 Z"/>'):
        path.write_text(SVG.format(content + ground))
        with pytest.raises(UserError, match=r"not a readable SVG|shows no shape|no width"):
            images.read_outlines(path)
    path.write_text(SVG.format(TRIANGLE).replace("svg", "sug"))
    with refused("does not begin with an element svg"):
        images.read_outlines(path)


def test_a_drawing_of_many_curves_has_fewer_chords_in_each(tmp_path: Path) -> None:
    """3000 of them on a circle; a drawing of usual size keeps all of its chords."""
    path = tmp_path / "void.svg"
    found = {}
    for count in (12, 3000):
        angle = np.linspace(0.0, 2 * np.pi, count + 1)
        ends = np.stack([50 + 40 * np.cos(angle), 50 + 40 * np.sin(angle)], axis=1)
        curves = " ".join(f"Q{x:.6f},{y:.6f} {x:.6f},{y:.6f}" for x, y in ends[1:])
        path.write_text(SVG.format(f'<path d="M90,50 {curves} Z"/>'))
        (outline,) = images.read_outlines(path)
        found[count] = len(outline)
        assert np.allclose(np.ptp(np.array(outline), axis=0), 80.0, atol=0.1)
    assert found[12] == 12 * images.SEGMENTS
    assert 3000 < found[3000] <= images.MOST_POINTS


def test_outlines_of_many_edges_need_little_memory() -> None:
    angle = np.linspace(0.0, 2 * np.pi, 20_000, endpoint=False)
    circle = tuple(zip(np.cos(angle).tolist(), np.sin(angle).tolist(), strict=True))
    points = [(x, 0.0) for x in np.linspace(0.0, 2.0, 301)]
    tracemalloc.start()
    try:
        inside = find_inside(points, (circle,), 1e-9)
        assert tracemalloc.get_traced_memory()[1] < 50e6
    finally:
        tracemalloc.stop()
    assert sum(inside) == 151


def test_a_file_is_read_up_to_its_bound_and_no_further(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(bytes(1000))
    assert read_bounded(path, 1000) == bytes(1000)
    with pytest.raises(OSError, match="1000 bytes, which is more than 999"):
        read_bounded(path, 999)
    os.truncate(path, 1 << 30)
    with refused("1073741824 bytes, which is more than 536870912"):
        csv_columns.read_cells(path)
    problem = tmp_path / "problem.yaml"
    problem.write_text("# " + "a" * (256 << 10) + "\ntitle: a\n")
    with pytest.raises(UserError, match="bytes, which is more than 262144"):
        yaml_file.read_yaml(problem)
