from collections.abc import Callable
from pathlib import Path

import pytest

from reports.__main__ import main
from reports.figures.study_report import study_report
from reports.page import publish
from reports.study import StudyResults
from tests.reports import compressed_study, shaken_study


@pytest.fixture(scope="session")
def study_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Gives the folder of the datasets of `study`."""
    return tmp_path_factory.mktemp("fig2")


@pytest.fixture(scope="session")
def study(study_folder: Path) -> StudyResults:
    return shaken_study.written(study_folder)


@pytest.fixture(scope="session")
def quick(tmp_path_factory: pytest.TempPathFactory) -> StudyResults:
    return shaken_study.written(tmp_path_factory.mktemp("quick"), "quick")


@pytest.fixture(scope="session")
def quick_report(quick: StudyResults, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("quick_report")
    publish(study_report(quick), folder)
    return folder


@pytest.fixture(scope="session")
def report(study: StudyResults, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    publish(study_report(study), folder)
    return folder


@pytest.fixture(scope="session")
def shield(tmp_path_factory: pytest.TempPathFactory) -> StudyResults:
    """A region to be spared from strain."""
    return compressed_study.written(tmp_path_factory.mktemp("shield"), compressed_study.SHIELD)


@pytest.fixture(scope="session")
def smile(tmp_path_factory: pytest.TempPathFactory) -> StudyResults:
    """A void to be hidden."""
    return compressed_study.written(tmp_path_factory.mktemp("smile"), compressed_study.SMILE)


Failing = Callable[..., str]


@pytest.fixture
def failing(capfd: pytest.CaptureFixture[str]) -> Failing:
    """Makes a page that cannot be made, of which nothing is left; returns what is told."""

    def told(kind: str, out: Path, *words: object) -> str:
        option = "--out" if out.suffix else "--out-dir"
        assert main([kind, *map(str, words), option, str(out)]) == 2
        error = capfd.readouterr().err
        assert "Traceback" not in error
        assert not out.exists()
        return error

    return told
