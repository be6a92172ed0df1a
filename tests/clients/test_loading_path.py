from pathlib import Path

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select

from reports.figures.study_report import study_report
from reports.page import publish
from reports.panels import animation_data
from reports.panels.structure_drawing import pads
from tests.clients.conftest import Open
from tests.clients.test_player import scrub
from tests.reports import compressed_study


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    smile = compressed_study.written(tmp_path_factory.mktemp("data"), compressed_study.SMILE)
    publish(study_report(smile), folder)
    return folder / "index.html"


@pytest.fixture
def browser(browse: Open, page: Path) -> Chrome:
    return browse(page, 1100, 800, 1.0)


def test_it_shows_three_structures_under_load_without_complaint(browser: Chrome) -> None:
    captions = browser.find_elements(By.CSS_SELECTOR, "#player figcaption")
    assert [caption.text for caption in captions] == ["Intact", "Voided", "Cloaked"]
    scrub(browser, 1.0)
    output = browser.find_element(By.CSS_SELECTOR, "#player output")
    assert output.text == "u = 15.0 mm"
    assert not browser.get_log("browser")  # type: ignore[no-untyped-call]


def test_units_that_are_cut_out_are_not_drawn(browser: Chrome) -> None:
    colours = browser.execute_script(
        """
        return [0, 1].map((index) => {
          const canvas = document.querySelectorAll("#player .stage canvas")[index];
          const pen = canvas.getContext("2d");
          const at = pen.getTransform().transformPoint(new DOMPoint(105, 67.5 - 7.5));
          return [...pen.getImageData(Math.round(at.x), Math.round(at.y), 1, 1).data];
        });
        """
    )
    assert colours[0][3] == 255
    assert colours[1][3] == 0


def test_pads_that_overlap_are_joined(
    browse: Open, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of the units of a kagome lattice do: strokes of one crossed the next."""
    smile = compressed_study.written(tmp_path, compressed_study.SMILE)
    monkeypatch.setattr(animation_data, "pads", lambda structure, side: pads(structure, side + 5))
    publish(study_report(smile), tmp_path / "report")
    colours = browse(tmp_path / "report/index.html", 1100, 800, 2.0).execute_script(
        """
        const canvas = document.querySelector("#player .stage canvas");
        const pen = canvas.getContext("2d");
        const pixel = (x, y) => {
          const at = pen.getTransform().transformPoint(new DOMPoint(x, y));
          return [...pen.getImageData(Math.round(at.x), Math.round(at.y), 1, 1).data].join();
        };
        const inside = [...Array(200).keys()].map((k) => pixel(-8.5, 0.3 * k));
        const across = [...Array(100).keys()].map((k) => pixel(-11 + 0.02 * k, 50));
        return [inside, across];
        """
    )
    inside, across = map(set, colours)
    assert inside == {"212,215,219,255"}
    assert "0,0,0,0" in across  # the edge is within the picture


def test_colours_begin_with_that_of_the_figure(browser: Chrome) -> None:
    menu = Select(browser.find_element(By.ID, "player-field"))
    assert [option.text for option in menu.options] == [
        "displacement along y",
        "displacement along x",
        "θ",
    ]
    plate = browser.find_element(By.CSS_SELECTOR, ".plate svg")
    assert plate.size["width"] > 700


def test_a_phone_shows_all_without_scrolling_sideways(browse: Open, page: Path) -> None:
    phone = browse(page, 390, 844, 3.0)
    width = phone.execute_script("return document.documentElement.scrollWidth")
    assert width <= 390
