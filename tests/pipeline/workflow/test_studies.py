from pathlib import Path

import pytest

from pipeline.runtime import UserError
from pipeline.workflow.studies import (
    Study,
    check_calibrations,
    check_names,
    check_targets,
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


@pytest.mark.parametrize("name", ["/elsewhere/mine", "experiments/mine"])
def test_a_path_is_no_name_of_a_study(name: str, tmp_path: Path) -> None:
    with refused("letters, digits and underscores only", remedy="not its path"):
        check_names(Study.parse(name), tmp_path)


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
    "name",
    ["all", "fig1", "index", "no_target", "sweep", "spectrum", "movies", "logs", "calibration"],
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
