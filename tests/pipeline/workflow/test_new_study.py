"""New studies from the templates: valid as they are, and nothing half made."""

import shutil
from pathlib import Path

import pytest

from pipeline.__main__ import run_stage
from pipeline.problem import void_units
from pipeline.problem.reading import load

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


@pytest.mark.parametrize("name", ["cat.png", "my cat's {best} $1, ü #2.png"])
def test_an_image_becomes_the_void(tmp_path: Path, name: str) -> None:
    image = Path(shutil.copyfile(CAT, tmp_path / name))
    assert run_stage("new", ["cat", "--image", str(image), "--folder", str(tmp_path)]) == 0
    assert (tmp_path / "cat" / name).read_bytes() == CAT.read_bytes()
    assert len(void_units(load(tmp_path / "cat/problem.yaml"))) > 30


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["2fast"], "not a name for a study"),
        (["taken"], "there is a study of this name"),
        (["x", "--image", "none.png"], "the image cannot be read"),
        (["x", "--image", str(CAT), "--kind", "dynamic"], "the dynamic template has no void"),
    ],
)
def test_a_mistake_makes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], told: str
) -> None:
    (tmp_path / "taken").mkdir()
    assert run_stage("new", [*words, "--folder", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert "remedy:" in error
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]
