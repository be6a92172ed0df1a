import base64
import csv
import dataclasses
import json
import re
from html.parser import HTMLParser
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from reports.base import Table
from reports.figures.shielding.sweep_map import frequency_map
from reports.figures.study_report import study_report
from reports.page import rendered
from reports.page.study_pages import LARGEST_PAGE
from reports.study import StudyResults


class Links(HTMLParser):
    """Addresses that a page loads or points to, and the ids that it has."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.hrefs: dict[str, str] = {}
        self.ids: set[str] = set()
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {name: value or "" for name, value in attrs}
        self.ids |= {found["id"]} if "id" in found else set()
        if "src" in found or tag == "link":
            self.loaded.append(found.get("src", found.get("href", "")))
        if tag == "a":
            self.hrefs[found.get("download", found["href"])] = found["href"]


@pytest.fixture(scope="module")
def html(report: Path) -> str:
    return (report / "index.html").read_text(encoding="utf-8")


def test_page_is_small_and_self_contained(html: str) -> None:
    assert len(html.encode()) < LARGEST_PAGE
    links = Links(html)
    assert all(address.startswith("data:") for address in links.loaded)
    assert not re.search(r"@import|url\((?!#)|fetch\(|XMLHttpRequest", html)
    assert not any(href.startswith("http") for href in links.hrefs.values())


def test_links_lead_somewhere_and_inlined_tables_are_the_files(html: str, report: Path) -> None:
    links = Links(html)
    for href in links.hrefs.values():
        if href.startswith("#"):
            assert href[1:] in links.ids
        elif not href.endswith(".nc"):  # the fixture's datasets have no files
            assert href.startswith("data:") or (report / href).is_file()
    tables = {name: href for name, href in Links(html).hrefs.items() if href.startswith("data:")}
    names = ("design", "facts", "loss_history", "robustness", "top_edge")
    assert sorted(tables) == [f"{name}.csv" for name in names]
    for name, href in tables.items():
        assert base64.b64decode(href.partition(",")[2]) == (report / name).read_bytes()


def test_tables_hold_what_the_panels_show(report: Path, study: StudyResults) -> None:
    def column(name: str, heading: str) -> np.ndarray:
        table = np.genfromtxt(
            report / name, delimiter=",", names=True, dtype=None, encoding="utf-8", deletechars=""
        )
        return np.asarray(table[heading])

    uy = study.response["displacement"].values[1, 1, :, 7 + 15 * 14, 1]
    np.testing.assert_allclose(column("top_edge.csv", "cloaked_45deg_uy_mm"), uy, rtol=1e-9)
    losses = frequency_map(study.sweep)["loss"].values.ravel()
    np.testing.assert_allclose(column("robustness.csv", "J_cloaked"), losses, rtol=1e-9)
    assert len(column("loss_history.csv", "J")) == 220  # 160 by SQP, 60 by MMA
    assert len(column("design.csv", "x_mm")) == 900


def test_page_tells_where_it_is_from(html: str, study: StudyResults) -> None:
    for digest in study.files.values():
        assert digest in html
    for data in study.datasets.values():
        assert data.attrs["problem_hash"] in html
    assert "<li>simulation of the unloaded reference: it is zero</li>" in html
    assert "<li>2 of 4 load cases (altered)</li>" in html
    assert "<dt>plan: cloaked: integrator</dt><dd>implicit</dd>" in html
    assert "&#34;spacing&#34;: 15.0" in html


def test_page_shows_paper_and_ours(html: str, quick: StudyResults, quick_report: Path) -> None:
    for words in ("≈ 70 %", "88.0 %", "5.2 mm", "63 %", "&lt; 0.35"):
        assert words in html
    assert '<th scope="col">Paper</th>' in html
    assert "DRAFT" not in html
    draft = (quick_report / "index.html").read_text(encoding="utf-8")
    assert "DRAFT" in draft
    assert "49 units instead of 225" in draft
    settings = quick.problem.report.model_copy(update={"paper": None})
    alone = page_of(quick, report=settings)
    assert "Paper</th>" not in alone
    assert "<span>paper" not in alone


def page_of(study: StudyResults, **changes: object) -> str:
    problem = study.problem.model_copy(update=changes)
    return rendered(study_report(dataclasses.replace(study, problem=problem)), {})


def test_words_of_a_problem_are_escaped(quick: StudyResults) -> None:
    html = page_of(quick, title="</script><b>&", doc="</script><b>")
    assert "<title>&lt;/script&gt;&lt;b&gt;&amp;</title>" in html
    assert html.count("</script>") == 2
    data = re.search(r'id="player-data">(.*?)</script>', html, re.DOTALL)
    assert data is not None
    assert json.loads(data[1])["cases"][0].startswith("α")


def test_cells_of_a_table() -> None:
    columns = {
        "number": np.array([1.0 / 3.0, np.nan]),
        "count": np.array([7, -8]),
        "text, quoted": np.array(['a, "b"', "plain"]),
    }
    assert Table("t.csv", "", columns).csv.decode() == (
        'number,count,"text, quoted"\n0.3333333333,7,"a, ""b"""\n,-8,plain\n'
    )
    # a spreadsheet computes no cell
    words = ["=1+1", "@a", "+cmd", "-5 mm", "−5 mm", "a=b", "-1e-3", "", "=HYPERLINK(1)"]
    table = Table("t.csv", "", {"word": words, "number": np.linspace(-1.0, 1.0, len(words))})
    rows = list(csv.reader(StringIO(table.csv.decode())))
    shown = ["'=1+1", "'@a", "'+cmd", "'-5 mm", "−5 mm", "a=b", "-1e-3", "", "'=HYPERLINK(1)"]
    assert [row[0] for row in rows[1:]] == shown
    assert rows[1][1] == "-1"


def test_a_preset_is_not_judged_by_the_claims_on_the_study(study: StudyResults) -> None:
    """Another design than the paper's has no part in what the paper claims."""
    preset = dataclasses.replace(study, preset="free")
    of_study, of_preset = (study_report(each).values["claims"] for each in (study, preset))
    assert len(of_study) > 0
    assert of_preset == []
