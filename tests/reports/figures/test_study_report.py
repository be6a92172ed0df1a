from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from pipeline.runtime import UserError
from reports.__main__ import main
from reports.figures.study_report import study_report
from reports.page import publish
from reports.study import StudyResults
from tests.reports import shaken_study
from tests.reports.conftest import Failing


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def command(paths: Sequence[Path], out: Path, preset: str | None) -> list[str]:
    names = zip(shaken_study.KINDS, paths, strict=True)
    given = [word for name, path in names for word in (f"--{name}", str(path))]
    chosen = [] if preset is None else ["--preset", preset]
    return ["study", "--problem", str(shaken_study.PROBLEM), *chosen, *given, "--out-dir", str(out)]


def test_report_is_complete_and_what_may_not_be_meant_stands_at_its_top(report: Path) -> None:
    assert sorted(contents(report)) == [
        "design.csv", "facts.csv", "facts.json", "fig2.pdf", "fig2.png", "fig2.svg",
        "index.html", "loss_history.csv", "robustness.csv", "top_edge.csv",
    ]  # fmt: skip
    page = (report / "index.html").read_text(encoding="utf-8")
    note = f'<p class="warning" role="note">{shaken_study.WARNED}; shims of '
    assert page.index(note) < page.index('id="figure"')


@pytest.mark.slow
def test_rebuilding_gives_the_same_bytes(study: StudyResults, report: Path, tmp_path: Path) -> None:
    publish(study_report(study), tmp_path / "again")
    assert contents(tmp_path / "again") == contents(report)


@pytest.mark.slow
def test_command_line(tmp_path: Path) -> None:
    paths = shaken_study.write(tmp_path, "quick")
    out = tmp_path / "report"
    assert main(command(paths, out, "quick")) == 0
    assert (out / "index.html").is_file()
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "design.nc", "report", "response.nc", "scatter.nc", "sweep.nc"
    ]  # fmt: skip


@pytest.mark.usefixtures("study")
def test_datasets_of_another_problem_are_refused(
    study_folder: Path, tmp_path: Path, failing: Failing
) -> None:
    paths = [study_folder / f"{kind}.nc" for kind in shaken_study.KINDS]
    kind, *words, _, out = command(paths, tmp_path / "report", "quick")
    told = failing(kind, Path(out), *words)
    assert "the dataset was made from another problem" in told
    assert "design.nc" in told


@pytest.mark.slow
def test_a_build_that_fails_leaves_the_old_report(
    quick: StudyResults, quick_report: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, beside = contents(quick_report), sorted(quick_report.parent.iterdir())

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device", "facts.json")

    monkeypatch.setattr("reports.facts.fact_records.write_json", full)
    with pytest.raises(UserError, match="the disk is full"):
        publish(study_report(quick), quick_report)
    assert contents(quick_report) == before
    assert sorted(quick_report.parent.iterdir()) == beside


def test_what_a_killed_build_left_goes(quick: StudyResults, tmp_path: Path) -> None:
    report, folder = replace(study_report(quick), figures={}, template=""), tmp_path / "report"
    publish(report, folder)
    left = tmp_path / ".report.part"
    left.mkdir()
    (left / "facts.json").write_text("half a file", encoding="utf-8")
    before = contents(folder)
    publish(report, folder)
    assert "facts.json" in before
    assert contents(folder) == before
    assert not left.exists()
