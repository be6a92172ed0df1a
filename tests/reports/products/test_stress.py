import csv
import json
from pathlib import Path

import pytest

from reports.__main__ import main
from tests.reports.conftest import Failing
from tests.tables import tables

FAMILY = tables("reports")["stress_family"]


@pytest.fixture
def counts(tmp_path: Path) -> Path:
    path = tmp_path / "stress.json"
    path.write_text(json.dumps({"schema_version": 1, "families": [FAMILY]}), encoding="utf-8")
    return path


def page(counts: Path, folder: Path) -> str:
    assert main(["stress", "--counts", str(counts), "--out-dir", str(folder), "--quiet"]) == 0
    return (folder / "index.html").read_text(encoding="utf-8")


def test_the_page_shows_counts_and_what_was_not_solved(counts: Path, tmp_path: Path) -> None:
    html = page(counts, tmp_path / "page")
    assert page(counts, tmp_path / "again") == html
    assert '<strong class="wrong">1</strong>' in html
    assert "two &amp; more &lt;cases&gt;" in html
    assert "99.8 %" in html  # 997 of 998, not rounded up
    assert "refused, as it has no answer" in html
    assert "off: 2, limit 1" in html
    rows = list(csv.DictReader((tmp_path / "page/stress.csv").open(encoding="utf-8")))
    assert [(row["name"], row["wrong"]) for row in rows] == [("toy", "1")]


@pytest.mark.parametrize("content", ["", "{}", '{"families": [{"name": "toy"}]}', "[1]"])
def test_foreign_counts(content: str, counts: Path, tmp_path: Path, failing: Failing) -> None:
    counts.write_text(content, encoding="utf-8")
    assert str(counts) in failing("stress", tmp_path / "page", "--counts", counts)
