"""The pages after the tutorial do as they say, with a draft in the place of its study."""

from __future__ import annotations

import re

import pytest

from tests.docs.pages import PLACE, text
from tests.docs.walk import Reader


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> Reader:
    """Who has done as the tutorial says."""
    made = Reader.in_folder(tmp_path_factory.mktemp("pages") / "checkout", draft=True)
    made.told("docs/tutorial.md")
    return made


def test_a_video_of_ones_own(reader: Reader) -> None:
    told = reader.told("docs/video.md")
    for name in ("run1.nc", "run1.csv", "run1_report/index.html", "proposed/run1_units.png"):
        assert (reader.checkout.root / "films" / name).is_file()
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
