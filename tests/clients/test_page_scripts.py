"""The same player on a static study: load steps instead of time, one case, a lost unit."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from reports.figures.study_report import study_report
from reports.page import rendered
from reports.panels import Animation, AnimationAxis, AnimationClip, ColourField, payload
from reports.study import from_dataset
from tests.clients.conftest import Open
from tests.clients.test_player import at, scrub
from tests.reports import shaken_study

LOST = 8


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("static")
    study = shaken_study.written(folder, "quick")
    structure = from_dataset(study.design, study.scene.spacing)
    loads = np.array([0.0, 0.5, 2.0, 5.0])
    motion = np.zeros((1, 4, structure.n_units, 3))
    motion[0, :, :, 0] = -0.05 * loads[:, None] * structure.site[:, 0] / 15.0
    motion[0, 1:, LOST] = np.nan
    reel = Animation(
        AnimationAxis("load", "mm", loads, 1, False, {"slow": 2.0, "fast": 50.0}),
        ["compression"],
        [AnimationClip("Cloaked", "#6f3fa0", structure, motion)],
        [ColourField("ux", "u_x", "mm", 1.0, "signed", (-2.0, 2.0))],
    )
    made = study_report(study)
    player = json.dumps(payload(reel), ensure_ascii=False)
    values = {**made.values, "player": player}
    path = folder / "index.html"
    path.write_text(rendered(dataclasses.replace(made, values=values), {}), encoding="utf-8")
    return path


@pytest.fixture
def browser(browse: Open, page: Path) -> Chrome:
    return browse(page, 800, 600, 1.0)


def test_it_plays_to_the_last_load_and_stops(browser: Chrome) -> None:
    button = browser.find_element(By.CSS_SELECTOR, "#player .play")
    button.click()
    WebDriverWait(browser, 10).until(lambda _: button.text == "Play")
    assert at(browser) == pytest.approx(5.0)
    button.click()
    assert at(browser) < 5.0


def test_the_slider_runs_over_uneven_loads_of_a_single_case(browser: Chrome) -> None:
    scrub(browser, 0.5)
    assert at(browser) == pytest.approx(2.5)
    assert not browser.find_elements(By.ID, "player-case")
    assert browser.find_element(By.CSS_SELECTOR, "#player output").text == "load = 2.5 mm"


def test_a_lost_unit_stays_blank(browser: Chrome) -> None:
    scrub(browser, 1.0)
    colours = browser.execute_script(
        """
        const canvas = document.querySelector("#player .stage canvas");
        const pen = canvas.getContext("2d");
        const toPixels = pen.getTransform();
        return arguments[0].map(([x, y]) => {
          const at = toPixels.transformPoint(new DOMPoint(x, y));
          return [...pen.getImageData(Math.round(at.x), Math.round(at.y), 1, 1).data];
        });
        """,
        [[15.0, 15.0], [15.0 * 6 - 0.05 * 5 * 6, 15.0 * 3]],
    )
    assert colours[0] == [255, 255, 255, 255]  # unit (1, 1), number 8
    assert colours[1][0] < 200  # moved to the left: blue
    assert colours[1][2] > colours[1][0]
