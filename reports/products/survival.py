"""Tells what was tried to lose or to spoil results: tables of tried and survived."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any, NamedTuple

from reports.base import prose
from reports.page import write_page

_PROSE = prose(__file__)


class SurvivalTable(NamedTuple):
    """Describes a section of the page.

    Attributes:
        name, title, text: what was tried.
        columns: of the table: what, tried, survived, and details.
        rows: its cells.
        total: their sums.
        faults: what was lost, in words.
        seed: of what was random.
        commit: that was tried.
    """

    name: str
    title: str
    text: str
    columns: list[str]
    rows: list[list[Any]]
    total: list[Any]
    faults: list[str]
    seed: int
    commit: str


def report(args: argparse.Namespace) -> None:
    """Writes ``index.html`` over the JSON files in a folder, one for each part that was tried."""
    paths = {name: args.out_dir / f"{name}.json" for name in _PROSE}
    parts = [_part(name, path) for name, path in paths.items() if path.is_file()]
    totals = [sum(part.total[k] for part in parts) for k in (1, 2)]
    values = {"parts": parts, "totals": totals}
    write_page(args.out_dir / "index.html", "survival.html.j2", values)


def _part(name: str, path: Path) -> SurvivalTable:
    told = json.loads(path.read_text(encoding="utf-8"))
    details = [key for key in told["rows"][0] if key not in ("what", "tried", "survived")]
    columns = ["tried", "survived", *details]
    rows = [[row["what"], *(row[key] for key in columns)] for row in told["rows"]]
    total = ["all", *(sum(row[key] for row in told["rows"]) for key in columns)]
    about = {key: told[key] for key in ("faults", "seed", "commit")} | _PROSE[name]
    return SurvivalTable(name, columns=["what", *columns], rows=rows, total=total, **about)
