from pathlib import Path

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

from reports.__main__ import main
from reports.figures.study_report import study_report
from reports.page import publish
from tests.clients.conftest import Open
from tests.clients.test_player import choose, complaints, picture, scrub
from tests.reports import recorded_study, shaken_study


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    (folder / "data").mkdir()
    study = shaken_study.written(folder / "data")
    filmed = recorded_study.with_recordings(study, folder / "fig2/recordings", ("altered", 1))
    publish(study_report(filmed), folder / "fig2/report")
    assert main(["index", "--results", str(folder), "--quiet"]) == 0
    return folder


@pytest.fixture
def page(browse: Open, results: Path) -> Chrome:
    return browse(results / "fig2/report/index.html", 1280, 900, 1.0)


def captions(browser: Chrome) -> list[str]:
    shown = browser.find_elements(By.CSS_SELECTOR, "#player figure")
    return [figure.text for figure in shown if figure.is_displayed()]


def test_experiment_stands_beside_simulation_under_its_own_load(page: Chrome) -> None:
    assert captions(page) == ["Altered, experiment (SYNTHETIC)", "Altered", "Cloaked"]
    choose(page, "case", "α = 90°")
    assert captions(page) == ["Altered", "Cloaked"]
    assert complaints(page) == []


def test_both_move_in_step(page: Chrome) -> None:
    before = [picture(page, k) for k in (0, 1)]
    page.find_element(By.ID, "player").send_keys(Keys.ARROW_RIGHT * 5)
    assert all(picture(page, k) != old for k, old in enumerate(before))


def test_the_residual_has_a_view_of_its_own(page: Chrome) -> None:
    scrub(page, 0.0625)
    motion = [picture(page, k) for k in (0, 1)]
    view = page.find_element(By.ID, "player-view")
    view.send_keys(Keys.ARROW_DOWN)
    assert Select(view).first_selected_option.text == "residual: measured less simulated"
    assert [picture(page, k) != old for k, old in enumerate(motion)] == [True, True]
    assert "residual |U|" in page.find_element(By.CSS_SELECTOR, "#player .bar").text
    choose(page, "field", "displacement along y")
    choose(page, "view", "motion")
    assert complaints(page) == []


def test_it_says_that_nothing_was_filmed(page: Chrome) -> None:
    assert page.find_element(By.CSS_SELECTOR, "header .synthetic").text.startswith("SYNTHETIC")


@pytest.mark.parametrize(("width", "ratio"), [(1280, 1.0), (390, 3.0)])
def test_the_index_leads_to_the_page(browse: Open, results: Path, width: int, ratio: float) -> None:
    browser = browse(results / "index.html", width, 844, ratio)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= width
    image = browser.find_element(By.CSS_SELECTOR, "#figures img")
    assert browser.execute_script("return arguments[0].naturalWidth", image) > 400
    assert complaints(browser) == []
    link = browser.find_element(By.CSS_SELECTOR, "#figures h3 a")
    link.send_keys(Keys.ENTER)
    assert browser.find_elements(By.ID, "player")
