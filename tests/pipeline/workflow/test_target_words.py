"""Words that name nothing are refused, with the names that may be meant."""

from pathlib import Path

import pytest

from pipeline.__main__ import run_stage
from pipeline.workflow import rule_inputs, studies
from pipeline.workflow.studies import Study
from pipeline.workflow.target_words import built_by, check_words
from tests.pipeline.conftest import Failing
from tests.tables import refused


@pytest.mark.parametrize(
    ("word", "near"), [("fig2x", "fig2"), ("fig2_qick", "fig2_quick"), ("indx", "index")]
)
def test_a_mistyped_target_is_told_with_what_is_near(word: str, near: str) -> None:
    with refused(f"nothing is named {word}", "target", f"did you mean {near}"):
        check_words(["--cores", "4", word])


@pytest.mark.parametrize(
    "words",
    [["mycloak"], ["fig2", "mycloak"], ["-n", "mycloak"], ["mycloak@quick", "--cores", "2"]],
)
def test_a_word_that_no_option_takes_has_to_be_a_target(words: list[str]) -> None:
    with refused("nothing is named mycloak", "target", "name a target: fig2, "):
        check_words(words)


def test_what_may_be_an_option_or_a_file_is_left_alone() -> None:
    """And targets, rules, products; a preset that is unknown is told by its problem file."""
    targets = ["fig2", "fig6@quick", "fig2_quick", "index", "all", "fig2_sweep", "fig2@qick"]
    check_words([*targets, "-n", "--cores", "4", "slurm", "results/fig2x/report/index.html"])
    check_words(["zzz/results.csv", "clean", "--quiet", "progress"])


def test_a_target_is_built_in_its_folder() -> None:
    assert built_by("fig2_quick") == built_by("fig2@quick") == "fig2@quick"
    assert built_by("fig6") == "fig6"
    with refused("no preset 'qick'", "presets", "did you mean 'quick'"):
        built_by("fig2@qick")
    with refused("no study or figure is named fig2_sweep", "target", "name a target"):
        built_by("fig2_sweep")


@pytest.mark.parametrize("stage", ["check", "publish", "reproduce"])
def test_stages_that_take_a_study_name_those_that_there_are(
    stage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: Failing
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    told = failing(stage, ["nosuch"])
    assert "is named nosuch" in told
    assert "name a target: fig2, fig3" in told
    assert list(tmp_path.iterdir()) == []


def test_a_folder_whose_name_no_study_can_have(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is refused by its name, and neither as a preset nor as a word that is near itself."""
    (tmp_path / "experiments/my@study").mkdir(parents=True)
    monkeypatch.setattr(studies.check_folder, "__defaults__", (tmp_path,))
    for refuse in (built_by, lambda word: check_words(["fig2", word, f"{word}_sweep"])):
        with refused("letters, digits and underscores only", remedy="name it my_study"):
            refuse("my@study")


def test_a_study_called_like_a_rule_is_refused_before_it_is_checked(
    monkeypatch: pytest.MonkeyPatch, failing: Failing
) -> None:
    monkeypatch.setattr(studies, "rule_names", lambda: ("fig3",))
    assert "the target fig3 would be both of fig3 and of a rule" in failing("check", ["fig3"])


def test_a_figure_of_several_names_its_studies(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_stage("check", ["fig6"]) == 2
    assert "check each by its own name: fig6_heart" in capsys.readouterr().err


def test_no_study_is_read_that_is_not_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[Study] = []
    monkeypatch.setattr(rule_inputs, "check_names", read.append)
    rule_inputs.check_problems(["--cores", "4", "nothing_alike"])
    assert read == []
    rule_inputs.check_problems(["fig2", "--cores", "4"])
    assert read == [Study("fig2")]
