from __future__ import annotations

from pathlib import Path

import pytest

from reports.build import publish
from reports.study import Study
from tests.reports import static, synthetic


@pytest.fixture(scope="session")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return synthetic.written(tmp_path_factory.mktemp("fig2"))


@pytest.fixture(scope="session")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return synthetic.written(tmp_path_factory.mktemp("quick"), "quick")


@pytest.fixture(scope="session")
def quick_report(quick: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("quick_report")
    publish(quick, folder)
    return folder


@pytest.fixture(scope="session")
def report(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    publish(study, folder)
    return folder


@pytest.fixture(scope="session")
def shield(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """A region to be spared from strain."""
    return static.written(tmp_path_factory.mktemp("shield"), static.SHIELD)


@pytest.fixture(scope="session")
def smile(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """A void to be hidden."""
    return static.written(tmp_path_factory.mktemp("smile"), static.SMILE)
