"""The tutorials do as they say, with a draft in the place of their study."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipeline.problem import load, preset_names
from tests.docs.pages import PLACE, SLOW, WALKED, text
from tests.docs.walk import Reader


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> Reader:
    return Reader.in_folder(tmp_path_factory.mktemp("pages") / "checkout", draft=True)


@pytest.mark.parametrize("page", [page for page in WALKED if page not in SLOW])
def test_a_page_does_as_it_says(reader: Reader, page: str) -> None:
    PROMISED[page](reader.checkout.root, reader.told(page))


def _cloak(root: Path, told: str) -> None:
    problem = root / "experiments/logo/problem.yaml"
    assert load(problem).title == "Logo"
    assert preset_names(problem) == ("quick",)
    assert (root / "results/logo@quick/report/index.html").stat().st_size > 100_000
    altered, cloaked = re.findall(r"error ([\d.]+) force", told)
    assert float(cloaked) < 0.8 * float(altered)
    size = sum(path.stat().st_size for path in (root / "results/logo@quick").rglob("*"))
    stated = re.search(r"^\| a draft .*\| (\d+) \|$", text("docs/install.md"), re.MULTILINE)
    assert stated is not None
    assert 0.2 < size / (int(stated[1]) * 1e6) < 1.0


def _video(root: Path, told: str) -> None:
    for name in ("run1.nc", "run1.csv", "run1_report/index.html", "proposed/run1_units.png"):
        assert (root / "films" / name).is_file()
    seen = re.search(r"seen less simulated, mm: ([\d.]+)", told)
    assert seen is not None
    assert float(seen[1]) < 0.05
    assert "Tracking rehearsal of logo@quick" in told


def _questions(root: Path, told: str) -> None:
    messages = re.findall(r"```\n\n```text\n(error: .*?)```", text("docs/faq.md"), re.DOTALL)
    for message in messages[-3:]:
        assert PLACE.sub("", message) in PLACE.sub("", told)
    assert "All tests passed!" in told
    assert not (root / "response.nc").exists()


PROMISED = {
    "docs/tutorial.md": _cloak,
    "docs/video.md": _video,
    "docs/faq.md": _questions,
}
