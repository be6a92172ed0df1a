import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from pipeline.runtime import ROOT
from tests.clients.conftest import Open


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    mkdocs = Path(sys.executable).with_name("mkdocs")
    subprocess.run(
        [mkdocs, "build", "--quiet", "--strict", "--site-dir", folder],
        cwd=ROOT,
        check=True,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
    )
    return folder


def test_the_search_finds_a_page_without_a_network(browse: Open, site: Path) -> None:
    browser = browse(site / "index.html", 1280, 900, 1.0)
    found = WebDriverWait(browser, 30)
    field = browser.find_element(By.CSS_SELECTOR, "input.md-search__input")
    field.click()
    field.send_keys("eigenfrequency")
    results = ".md-search-result__item a"
    found.until(lambda _: browser.find_elements(By.CSS_SELECTOR, results))
    links = [
        str(link.get_attribute("href")) for link in browser.find_elements(By.CSS_SELECTOR, results)
    ]
    assert any("numerics.html" in link for link in links)
    browser.get(links[0])
    assert "eigenfrequenc" in browser.find_element(By.TAG_NAME, "article").text.lower()
    asked = browser.execute_script(
        "return performance.getEntriesByType('resource').map(entry => entry.name)"
    )
    assert [url for url in asked if not url.startswith("file:")] == []
    told = browser.get_log("browser")  # type: ignore[no-untyped-call]
    assert [entry for entry in told if "http" in json.dumps(entry)] == []
