import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from selenium.webdriver import Chrome, ChromeOptions
from selenium.webdriver.chrome.service import Service

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
)

Open = Callable[[Path, int, int, float], Chrome]


def program(*names: str) -> str:
    """Path of the first of these programs that is installed."""
    found = next((path for name in names if (path := shutil.which(name))), None)
    assert found, f"{names[0]} is not installed: .ci/nightly tells which Debian packages are wanted"
    return found


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chrome]:
    options = ChromeOptions()
    options.binary_location = program("chromium", "chromium-browser", "google-chrome")
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    browser = Chrome(options=options, service=Service(program("chromedriver")))
    yield browser
    browser.quit()


@pytest.fixture
def browse(chromium: Chrome) -> Open:
    """Opens a file at a width and height in CSS pixels and a pixel ratio, without a network."""

    def open_page(path: Path, width: int, height: int, ratio: float) -> Chrome:
        metrics = {"width": width, "height": height, "deviceScaleFactor": ratio}
        phone = {"mobile": width < 600}
        chromium.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics | phone)
        chromium.execute_cdp_cmd("Network.enable", {})
        chromium.execute_cdp_cmd("Network.setBlockedURLs", {"urls": ["http://*", "https://*"]})
        chromium.get_log("browser")  # type: ignore[no-untyped-call]  # forget what was before
        chromium.get(path.resolve().as_uri())
        return chromium

    return open_page
