from pathlib import Path

import pytest

from reports.base import style
from reports.figures.framework import figure
from reports.figures.framework.framework_report import framework_report
from reports.page import publish
from reports.study import StudyResults
from tests.reports import figure_assertions, recorded_study
from tests.reports.page.test_report_page import Links


@pytest.fixture(scope="module")
def filmed(study: StudyResults, tmp_path_factory: pytest.TempPathFactory) -> StudyResults:
    return recorded_study.with_recordings(study, tmp_path_factory.mktemp("films"), ("cloaked", 1))


@pytest.fixture(scope="module")
def folder(filmed: StudyResults, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("framework")
    publish(framework_report(filmed), made)
    return made


def test_it_is_legible_and_tells_of_every_step(study: StudyResults) -> None:
    with style.styled():
        made = figure_assertions.drawn(figure.framework_figure(study).draw())
    figure_assertions.assert_legible(made)
    wanted = {"Reference", "Altered", "simulate", "optimised cloak", "filmed and tracked", *"abcd"}
    wanted |= {"SQP"}
    assert wanted <= figure_assertions.words(made)


def test_no_bands_are_told_of_as_none_are_drawn(filmed: StudyResults) -> None:
    told = figure.framework_figure(filmed).caption
    assert "dashed with markers" in told
    assert "bands" not in told


def test_its_page_works_from_disk(folder: Path) -> None:
    html = (folder / "index.html").read_text(encoding="utf-8")
    links = Links(html)
    assert all(address.startswith("data:") for address in links.loaded)
    assert {"fig1.pdf", "fig1.svg", "fig1.png"} <= set(links.hrefs.values())
    assert "SYNTHETIC" in html
    assert not any("index.html" in href for href in links.hrefs.values())  # it is made later


@pytest.mark.slow
def test_it_is_the_same_again(filmed: StudyResults, folder: Path, tmp_path: Path) -> None:
    for path in publish(framework_report(filmed), tmp_path):
        assert path.read_bytes() == (folder / path.name).read_bytes()
