"""The tutorial and the pages after it do as they say, with a draft in the place of its study."""

import re
from pathlib import Path

import pytest

from pipeline.problem.reading import load, preset_names
from tests.docs.pages import PLACE, WALKED, text
from tests.docs.walk import Reader


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> Reader:
    return Reader.in_folder(tmp_path_factory.mktemp("pages") / "checkout", draft=True)


def test_the_tutorial(reader: Reader) -> None:
    root, told = reader.checkout.root, reader.told("docs/tutorial.md")
    problem = root / "experiments/logo/problem.yaml"
    assert load(problem).title == "Logo"
    assert preset_names(problem) == ("quick",)
    assert (root / "results/logo@quick/report/index.html").stat().st_size > 100_000
    altered, cloaked = re.findall(r"loss ([\d.]+) force", told)
    assert float(cloaked) < 0.8 * float(altered)
    size = sum(path.stat().st_size for path in (root / "results/logo@quick").rglob("*"))
    stated = re.search(r"^\| a draft .*\| (\d+) \|$", text("docs/install.md"), re.MULTILINE)
    assert stated is not None
    assert 0.2 < size / (int(stated[1]) * 1e6) < 1.0


def test_a_video_of_ones_own(reader: Reader) -> None:
    told = reader.told("docs/video.md")
    made = (".nc", ".csv", "_report/index.html")
    for name in (f"{video}{each}" for video in ("phone", "run1") for each in made):
        assert (reader.checkout.root / "films" / name).is_file()
    assert (reader.checkout.root / "films/proposed/phone_units.png").is_file()
    seen = re.search(r"seen less simulated, mm: ([\d.]+)", told)
    assert seen is not None
    assert float(seen[1]) < 0.05
    assert "Tracking rehearsal of logo@quick" in told


def test_questions_and_answers(reader: Reader) -> None:
    told = reader.told("docs/faq.md")
    messages = re.findall(r"```\n\n```text\n(error: .*?)```", text("docs/faq.md"), re.DOTALL)
    for message in messages[-3:]:
        assert PLACE.sub("", message) in PLACE.sub("", told)
    assert "All tests passed!" in told
    assert not (reader.checkout.root / "response.nc").exists()


def test_the_tutorials(tmp_path: Path) -> None:
    root = tmp_path / "checkout"
    reader = Reader.in_folder(root, draft=False)
    said = {page: reader.told(page) for page in WALKED}
    for name in ("assembly.pdf", "bom.csv", "fixture", "laser", "manifest.json", "print"):
        assert name in said["docs/printer.md"].split()
    assert (root / "dots.pdf").read_bytes().startswith(b"%PDF")
    assert (root / "results/logo/report/index.html").is_file()
    assert (root / "results/logo/recordings/rehearsal/track.nc").is_file()
