from pathlib import Path

import pytest

from pipeline.__main__ import run_stage
from pipeline.runtime import UserError
from pipeline.workflow import rule_inputs
from pipeline.workflow.studies import (
    Study,
    check_calibrations,
    check_targets,
    check_words,
    families,
    joints,
)
from tests.tables import refused

PROBLEM = "title: a\npresets:\n  {preset}: {{}}\n"


def study(root: Path, name: str, preset: str = "quick") -> None:
    folder = root / "experiments" / name
    folder.mkdir(parents=True)
    (folder / "problem.yaml").write_text(PROBLEM.format(preset=preset))


def fault(root: Path) -> UserError:
    families.cache_clear()
    joints.cache_clear()
    with pytest.raises(UserError) as caught:
        check_targets(root)
    return caught.value


def test_names_of_their_own_are_left_alone(tmp_path: Path) -> None:
    study(tmp_path, "mine")
    study(tmp_path, "fig2", "edge3")
    families.cache_clear()
    joints.cache_clear()
    check_targets(tmp_path)


@pytest.mark.parametrize(
    "preset", ["fabrication", "sweep", "gains", "front", "recordings", "2_fabrication"]
)
def test_a_preset_called_like_a_product(preset: str, tmp_path: Path) -> None:
    study(tmp_path, "mine", preset)
    study(tmp_path, "mine_2")
    found = fault(tmp_path)
    assert found.file == "experiments/mine/problem.yaml"
    assert (found.key, found.remedy) == (f"presets.{preset}", "rename the preset")


@pytest.mark.parametrize(
    "name", ["all", "fig1", "index", "sweep", "spectrum", "movies", "logs", "calibration"]
)
def test_a_study_called_like_a_target_or_a_folder(name: str, tmp_path: Path) -> None:
    study(tmp_path, name)
    found = fault(tmp_path)
    assert "a rule of the workflow" in found.what
    assert (found.file, found.remedy) == (f"experiments/{name}/problem.yaml", "rename its folder")


@pytest.mark.parametrize("name", ["test", "docs", "setup", "any_load", "clean"])
def test_a_study_called_like_what_make_does(name: str, tmp_path: Path) -> None:
    study(tmp_path, name)
    assert fault(tmp_path).remedy == "rename its folder"


def test_all_names_are_checked_at_once(tmp_path: Path) -> None:
    """A study like a product of another, and one like a preset of it."""
    for name, preset in (("a", "b"), ("a_sweep", "c"), ("a_b", "d")):
        study(tmp_path, name, preset)
    found = fault(tmp_path)
    assert found.what == "the target a_sweep would be both of a_sweep and of the study a"
    assert str(found.remedy).endswith("; and likewise of: a@b")


def test_a_calibration_with_an_odd_name(tmp_path: Path) -> None:
    folder = tmp_path / "experiments/calibration"
    folder.mkdir(parents=True)
    (folder / "good_1.yaml").touch()
    check_calibrations(tmp_path)
    (folder / "my fit-2.yaml").touch()
    with refused("name of a calibration", remedy="name it my_fit_2"):
        check_calibrations(tmp_path)


@pytest.mark.parametrize(
    ("word", "near"), [("fig2x", "fig2"), ("fig2_qick", "fig2_quick"), ("indx", "index")]
)
def test_a_mistyped_target_is_told_with_what_is_near(word: str, near: str) -> None:
    with refused(f"nothing is named {word}", "target", f"did you mean {near}"):
        check_words(["--dry-run", word])


def test_what_may_be_an_option_or_a_file_is_left_alone() -> None:
    """And targets, rules, products; a preset that is unknown is told by its problem file."""
    targets = ["fig2", "fig6@quick", "fig2_quick", "index", "all", "fig2_sweep", "fig2@qick"]
    check_words([*targets, "-n", "--cores", "4", "slurm", "results/fig2x/report/index.html"])


def test_a_figure_of_several_names_its_studies(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_stage("check", ["fig6"]) == 2
    assert "check each by its own name: fig6_heart" in capsys.readouterr().err


def test_a_mistyped_target_is_not_blamed_on_the_first_study(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    read: list[Study] = []
    monkeypatch.setattr(rule_inputs, "check_names", read.append)
    monkeypatch.setattr(rule_inputs, "check_measured_constants", lambda *_: None)
    rule_inputs.check_problems(["nothing_alike"])
    assert read == []
    rule_inputs.check_problems(["--cores", "4"])
    assert len(read) == 1
