from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest

from pipeline.problem.sections import Codec
from pipeline.virtual_lab import encode_video
from reports.__main__ import main
from reports.base import style
from reports.panels import Animation, AnimationAxis, AnimationClip, ColourField
from reports.paper_figures import movies_of, paper_movies
from reports.products.movie import layout as layout_module
from reports.products.movie.frames import RATE, images, instants
from reports.products.movie.layout import HEIGHT, WIDTH, layout
from reports.study import RigidUnits
from tests.reports import compressed_study

SIZE = 10.0


def reel(cases: int = 2) -> Animation:
    """Two units beside each other that rise by 4 mm; the second is lost, the second case empty."""
    site = np.array([[0.0, 0.0], [15.0, 0.0]])
    corners = SIZE * (np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) - 0.5)
    none, flags = np.zeros((0, 2), int), np.zeros(2, int)
    structure = RigidUnits(site[:, None] + corners, site, none, none, flags, flags)
    motion = np.zeros((cases, 3, 2, 3))
    motion[:, :, 0, 1] = [0.0, 2.0, 4.0]
    motion[:, :, 1] = np.nan
    first = AnimationClip("Altered", "#e07b00", structure, motion)
    second = AnimationClip("Cloaked", "#6f3fa0", structure, motion.copy())
    second.motion[1:] = np.nan
    axis = AnimationAxis("t", "s", np.array([0.0, 0.5, 1.0]), 2, True, {"real time": 1.0})
    field = ColourField("uy", "u_y", "mm", 1.0, "signed", (-4.0, 4.0))
    return Animation(axis, [f"α = {k}°" for k in range(cases)], [first, second], [field])


def test_load_cases_stand_in_columns_and_run_as_in_the_player() -> None:
    placed = layout(reel())
    where = [(cell.clip.name, cell.case, cell.row, cell.column) for cell in placed.cells]
    assert where == [("Altered", 0, 0, 0), ("Altered", 1, 0, 1), ("Cloaked", 0, 1, 0)]
    side_by_side = [(cell.row, cell.column) for cell in layout(reel(1)).cells]
    assert side_by_side == [(0, 0), (0, 1)]
    assert len(instants(reel())) == RATE
    slow = replace(reel().axis, speeds={"slow": 0.5})
    assert len(instants(replace(reel(), axis=slow))) == 2 * RATE


def test_units_are_where_they_should_be_in_the_colour_of_their_motion() -> None:
    shown = reel(1)
    placed = layout(shown)
    *_, last = images(shown, "title", "")
    assert last.shape == (HEIGHT, WIDTH, 3)
    expected = [np.array(style.SIGNED(1.0))[:3], np.ones(3)]
    for point, colour in zip(([0.0, 4.0], [15.0, 0.0]), expected, strict=True):
        at = (np.array(point) - placed.corner) * [1, -1] * placed.scale
        x, y = np.rint(at + placed.origin(placed.cells[0])).astype(int)
        np.testing.assert_allclose(last[y, x], 255 * colour, atol=3)


def test_the_same_frames_make_the_same_bytes(tmp_path: Path) -> None:
    def made(name: str) -> bytes:
        path = tmp_path / name
        encode_video(path, list(images(reel(1), "title", "note"))[::8], RATE, Codec(crf=20), {})
        return path.read_bytes()

    assert made("a.mp4") == made("b.mp4")


def test_a_movie_is_built_from_its_studies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "study"
    folder.mkdir()
    made = compressed_study.written(folder, compressed_study.SHIELD)
    monkeypatch.setattr("reports.products.movie.frames.RATE", 1.0)
    out = tmp_path / "S2.mp4"
    words = ["--problems", str(folder / "problem.yaml"), "--results", str(tmp_path)]
    assert main(["movie", *words, "--out", str(out), "--quiet"]) == 0
    with av.open(str(out)) as video:
        assert video.metadata["title"] == "S2"
        assert sum(1 for _ in video.decode(video=0)) == 6
    assert made.name == "study"


def test_every_movie_of_the_paper_has_its_studies() -> None:
    assert list(paper_movies()) == ["S1", "S2", "S3", "S4"]
    assert movies_of(["fig6_heart", "fig6_shamrock"]) == ["S3"]
    assert movies_of(["fig2@quick"]) == []


@pytest.mark.parametrize("title", ["costs $5", "$\\frac{1$ of it", "a $ b $ c $", "$x^{$"])
def test_dollars_in_a_title_stay_dollars(title: str) -> None:
    drawn = layout_module.background(reel(1), layout(reel(1)), title, "")
    assert not np.array_equal(drawn, layout_module.background(reel(1), layout(reel(1)), "", ""))
