import inspect
from importlib import import_module

import pytest

from pipeline import problem
from pipeline.runtime import ROOT
from pipeline.runtime.source_closure import source_files
from reports.__main__ import main
from reports.catalogue import OPTIONS, REPORTS
from reports.figures import kinds
from reports.paper_figures import paper_figures

ALONE = [name for name, figure in paper_figures().items() if figure.studies == [name]]


@pytest.mark.parametrize("kind", REPORTS)
def test_kinds_have_functions_and_options(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    command = REPORTS[kind]
    parameters = inspect.signature(import_module(command.module).report).parameters
    assert list(parameters) == ["args"]
    assert {word.rstrip("?") for word in command.options.split()} <= set(OPTIONS)
    with pytest.raises(SystemExit) as end:
        main([kind, "--help"])
    assert end.value.code == 0
    assert command.description in " ".join(capsys.readouterr().out.split())


def test_an_unknown_kind_is_told_the_others(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["figure9"]) == 2
    assert "several-designs" in capsys.readouterr().err
    assert main([]) == 0


def test_a_rule_follows_the_sources_of_its_own_kind_alone() -> None:
    files = {path.relative_to(ROOT).as_posix() for path in source_files(REPORTS["sweep"].module)}
    assert "reports/products/sweep/figure.py" in files
    assert not any("spectrum" in file for file in files if file.startswith("reports/products"))
    assert "reports/catalogue.py" not in files


@pytest.mark.parametrize("name", [name for name in ALONE if name != "fig3"])
def test_problems_get_the_kind_that_the_list_of_figures_names(name: str) -> None:
    posed = problem.load(ROOT / f"experiments/{name}/problem.yaml")
    assert kinds.kind_of(posed).name == paper_figures()[name].kind


def test_kinds_of_figures_are_folders() -> None:
    folders = {path.name for path in (ROOT / "reports/figures").iterdir() if path.is_dir()}
    assert {figure.kind for figure in paper_figures().values()} <= folders
