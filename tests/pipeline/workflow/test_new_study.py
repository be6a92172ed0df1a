import shutil
from pathlib import Path

import pytest
from PIL import Image, ImageDraw

from pipeline.__main__ import run_stage
from pipeline.problem import void_units
from pipeline.problem.reading import load
from pipeline.runtime import ROOT
from pipeline.workflow import new_study
from pipeline.workflow.studies import families
from tests.pipeline.conftest import Failing

CAT = Path(__file__).parents[3] / "experiments/shapes/cat.png"


@pytest.mark.parametrize("kind", ["static", "dynamic"])
def test_a_template_is_a_problem(tmp_path: Path, kind: str) -> None:
    assert run_stage("new", ["my_study", "--kind", kind, "--folder", str(tmp_path)]) == 0
    path = tmp_path / "my_study/problem.yaml"
    assert load(path).title == "My study"
    assert "draft" in load(path, "quick").title
    assert path.read_text().count("# ") > 8
    made = load(path).fabrication
    assert made.shims.thickness + 2 * min(made.coupon) > made.laser.kerf


def test_a_draft_is_made_where_studies_are(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    with caplog.at_level("INFO"):
        assert run_stage("new", ["mine", "--folder", str(tmp_path / "other")]) == 0
        assert "then make mine@quick" in caplog.text
        assert f"move its folder to {ROOT / 'experiments'}" in caplog.text
        caplog.clear()
        monkeypatch.setattr(new_study, "WORK", tmp_path)
        assert run_stage("new", ["mine", "--folder", str(tmp_path / "experiments")]) == 0
        assert "a draft: make mine@quick" in caplog.text


@pytest.mark.parametrize("name", ["cat.png", "my cat's {best} $1, ü #2.png"])
def test_an_image_becomes_the_void(tmp_path: Path, name: str) -> None:
    image = Path(shutil.copyfile(CAT, tmp_path / name))
    assert run_stage("new", ["cat", "--image", str(image), "--folder", str(tmp_path)]) == 0
    assert (tmp_path / "cat" / name).read_bytes() == CAT.read_bytes()
    assert len(void_units(load(tmp_path / "cat/problem.yaml"))) > 30


def test_a_coloured_logo_becomes_a_void(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Neither dark nor light on nothing; then light on dark."""
    logo, shape = Image.new("RGBA", (200, 200)), (20, 20, 180, 180)
    ImageDraw.Draw(logo).ellipse(shape, fill=(200, 160, 40, 255))
    logo.save(tmp_path / "logo.png")
    words = ["--image", str(tmp_path / "logo.png"), "--folder", str(tmp_path)]
    assert run_stage("new", ["one", *words]) == 2
    assert "--threshold" in capsys.readouterr().err
    assert run_stage("new", ["one", *words, "--threshold", "0.95"]) == 0
    Image.alpha_composite(Image.new("RGBA", logo.size, "black"), logo).save(tmp_path / "logo.png")
    assert run_stage("new", ["two", *words, "--threshold", "0.2", "--invert"]) == 0
    one, two = (void_units(load(tmp_path / name / "problem.yaml")) for name in ("one", "two"))
    assert one == two
    assert len(one) == 52


def test_a_shape_that_no_draft_can_hold_makes_a_study(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Draws two discs, between which all of the units of the small lattice lie."""
    logo = Image.new("L", (300, 100), 255)
    for left in (0, 240):
        ImageDraw.Draw(logo).ellipse((left, 20, left + 59, 79), fill=0)
    logo.save(tmp_path / "logo.png")
    words = ["--image", str(tmp_path / "logo.png"), "--folder", str(tmp_path)]
    with caplog.at_level("INFO"):
        assert run_stage("new", ["two", *words]) == 0
    assert void_units(load(tmp_path / "two/problem.yaml"))
    assert "presets.quick.void is changed: no unit lies in the void" in caplog.text
    assert caplog.text.rstrip().endswith("make two")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["2fast"], "not a name for a study"),
        (["taken"], "there is a study of this name"),
        (["all"], "the target all is that of a rule of the workflow"),
        (["fig1"], "the target fig1 is that of a rule of the workflow"),
        (["report"], "value:  'report'"),
        (["movies"], "remedy: choose another name"),
        (["test"], "the target test is that of a command of make"),
        (["docs"], "the target docs is that of a command of make"),
        (["x", "--threshold", "0.5"], "key:    --threshold"),
        (["x", "--invert"], "give --image too"),
        (["x", "--image", "none.png"], "the image cannot be read"),
        (["x", "--image", str(CAT), "--threshold", "7"], f"file:   {CAT}"),
        (["x", "--image", str(CAT), "--kind", "dynamic"], "the dynamic template has no void"),
    ],
)
def test_a_mistake_makes_nothing(
    tmp_path: Path, failing: Failing, words: list[str], told: str
) -> None:
    (tmp_path / "taken").mkdir()
    assert told in failing("new", [*words, "--folder", str(tmp_path)])
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


@pytest.mark.parametrize("name", ["mine_quick", "mine_sweep", "mine_quick_front", "mine_2"])
def test_a_study_called_like_a_preset_or_product_is_refused(
    name: str, tmp_path: Path, failing: Failing
) -> None:
    folder = tmp_path / "experiments"
    assert run_stage("new", ["mine", "--folder", str(folder)]) == 0
    (folder / "mine_2_quick").mkdir()
    shutil.copy(folder / "mine/problem.yaml", folder / "mine_2_quick")
    families.cache_clear()
    told = failing("new", [name, "--folder", str(folder)])
    assert "is that of the study mine" in told
    assert "choose another name" in told
