from pathlib import Path

import numpy as np
import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webelement import WebElement
from selenium.webdriver.support.ui import Select, WebDriverWait

from reports.base.style import MAGNITUDE
from reports.figures.study_report import study_report
from reports.page import publish
from tests.clients.conftest import Open
from tests.reports import shaken_study

PICTURE = "return document.querySelectorAll('#player .stage canvas')[arguments[0]].toDataURL()"


@pytest.fixture(scope="session")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    publish(study_report(shaken_study.written(tmp_path_factory.mktemp("data"))), folder)
    return folder / "index.html"


@pytest.fixture
def desktop(browse: Open, page: Path) -> Chrome:
    return browse(page, 1280, 900, 1.0)


@pytest.fixture
def phone(browse: Open, page: Path) -> Chrome:
    return browse(page, 390, 844, 3.0)


def player(browser: Chrome) -> WebElement:
    return browser.find_element(By.ID, "player")


def at(browser: Chrome) -> float:
    return float(player(browser).get_attribute("data-at") or "nan")


def picture(browser: Chrome, structure: int) -> str:
    return str(browser.execute_script(PICTURE, structure))


def choose(browser: Chrome, menu: str, text: str) -> None:
    Select(browser.find_element(By.ID, f"player-{menu}")).select_by_visible_text(text)


def scrub(browser: Chrome, share: float) -> None:
    browser.execute_script(
        "const slider = document.querySelector('#player input');"
        "slider.value = arguments[0];"
        "slider.dispatchEvent(new Event('input'));",
        round(10000 * share),
    )


def complaints(browser: Chrome) -> list[str]:
    return [entry["message"] for entry in browser.get_log("browser")]  # type: ignore[no-untyped-call]


def test_it_plays_and_pauses(desktop: Chrome) -> None:
    button = desktop.find_element(By.CSS_SELECTOR, "#player .play")
    before = picture(desktop, 0)
    assert (button.text, at(desktop)) == ("Play", 0.0)
    button.click()
    assert button.text == "Pause"
    WebDriverWait(desktop, 10).until(lambda browser: at(browser) > 0.05)
    button.click()
    stopped = at(desktop)
    assert button.text == "Play"
    assert picture(desktop, 0) != before
    assert at(desktop) == stopped
    assert complaints(desktop) == []


def test_it_goes_round(desktop: Chrome) -> None:
    scrub(desktop, 0.99)
    choose(desktop, "speed", "real time")
    desktop.find_element(By.CSS_SELECTOR, "#player .play").click()
    WebDriverWait(desktop, 10).until(lambda browser: at(browser) < 1.0)
    assert player(desktop).get_attribute("data-playing") == "true"


def test_scrubbing_shows_the_time_and_the_motion(desktop: Chrome) -> None:
    scrub(desktop, 0.0)
    at_rest = picture(desktop, 0)
    scrub(desktop, 0.0625)
    assert at(desktop) == pytest.approx(0.125, abs=1e-3)
    assert desktop.find_element(By.CSS_SELECTOR, "#player output").text == "t = 0.125 s"
    assert picture(desktop, 0) != at_rest


def test_angle_and_colour_change_the_picture(desktop: Chrome) -> None:
    scrub(desktop, 0.0625)
    seen = {picture(desktop, 0)}
    choose(desktop, "case", "α = 90°")
    seen.add(picture(desktop, 0))
    for colour, symbol, unit in (("displacement along y", "u", "mm"), ("θ", "θ", "°")):
        choose(desktop, "field", colour)
        seen.add(picture(desktop, 0))
        bar = desktop.find_element(By.CSS_SELECTOR, "#player .bar").text
        assert symbol in bar
        assert unit in bar
    assert len(seen) == 4
    assert complaints(desktop) == []


def test_keys_play_step_and_jump(desktop: Chrome) -> None:
    box = player(desktop)
    box.send_keys(Keys.ARROW_RIGHT)
    assert at(desktop) == pytest.approx(0.01)
    box.send_keys(Keys.ARROW_RIGHT)
    box.send_keys(Keys.ARROW_LEFT)
    assert at(desktop) == pytest.approx(0.01)
    box.send_keys(Keys.END)
    assert at(desktop) == pytest.approx(2.0)
    box.send_keys(Keys.HOME)
    assert at(desktop) == 0.0
    box.send_keys(Keys.SPACE)
    assert box.get_attribute("data-playing") == "true"
    box.send_keys(Keys.SPACE)
    assert box.get_attribute("data-playing") == "false"


def test_keys_belong_to_the_menus_while_they_are_used(desktop: Chrome) -> None:
    menu = desktop.find_element(By.ID, "player-case")
    chosen = Select(menu).first_selected_option.text
    menu.send_keys(Keys.ARROW_DOWN)
    assert Select(menu).first_selected_option.text != chosen
    assert at(desktop) == 0.0


def test_units_are_drawn_where_the_dataset_has_them(desktop: Chrome, tmp_path: Path) -> None:
    study = shaken_study.written(tmp_path)
    scrub(desktop, 0.0625)
    choose(desktop, "field", "|U|")
    unit, structure, case, time = 112 + 3, 0, 1, 25  # beside the source, alpha = 45 deg
    part = study.response.isel(structure=structure, case=case, time=time)
    vertices = study.response["vertices"].values[structure]
    x, y = np.nanmean(vertices[unit], axis=0) + part["displacement"].values[unit, :2]
    scaled = part["displacement"].values[unit] / study.scene.scale
    colour = desktop.execute_script(
        """
        const canvas = document.querySelector("#player .stage canvas");
        const [x, y, low, high, margin] = arguments;
        const scale = canvas.width / (high - low + 2 * margin);
        const at = [(x - low + margin) * scale, (high + margin - y) * scale];
        return [...canvas.getContext("2d").getImageData(...at.map(Math.round), 1, 1).data];
        """,
        float(x), float(y), float(vertices.min()), float(vertices.max()),
        0.035 * float(np.ptp(vertices)),
    )  # fmt: skip
    limit = desktop.execute_script(
        "return JSON.parse(document.getElementById('player-data').textContent).fields[0].limits[1]"
    )
    expected = np.round(255 * np.array(MAGNITUDE(float(np.linalg.norm(scaled)) / limit)))
    np.testing.assert_allclose(colour, expected, atol=3)


def test_it_fits_a_phone_and_is_sharp(phone: Chrome) -> None:
    width = phone.execute_script("return document.documentElement.scrollWidth")
    assert width == 390
    sizes = phone.execute_script(
        "return [...document.querySelectorAll('#player canvas')].slice(0, 2)"
        ".map((canvas) => [canvas.width / canvas.clientWidth, canvas.clientWidth])"
    )
    for ratio, shown in sizes:
        assert ratio == pytest.approx(3.0, rel=0.02)
        assert shown > 150
    button = phone.find_element(By.CSS_SELECTOR, "#player .play")
    assert button.size["height"] >= 44
    button.click()
    WebDriverWait(phone, 10).until(lambda browser: at(browser) > 0.02)
    assert complaints(phone) == []


def test_controls_have_names(desktop: Chrome) -> None:
    for element in desktop.find_elements(By.CSS_SELECTOR, "#player input, select, button"):
        assert element.accessible_name
    for canvas in desktop.find_elements(By.CSS_SELECTOR, "#player .stage canvas"):
        label = canvas.get_attribute("aria-label") or ""
        assert "structure, α = 45°, t = 0.000 s" in label


def test_tables_download_from_the_page(desktop: Chrome, page: Path) -> None:
    link = desktop.find_element(By.CSS_SELECTOR, "a[download='robustness.csv']")
    text = desktop.execute_script("return atob(arguments[0].href.split(',')[1])", link)
    assert text == (page.parent / "robustness.csv").read_text(encoding="utf-8")
