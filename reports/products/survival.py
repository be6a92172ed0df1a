"""Tells what was tried to lose or to spoil results: tables of tried and survived."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any, NamedTuple

from reports.page import write_page

_TOLD = {
    "inputs": (
        "Damaged files",
        "One file of each kind that is read, with bits turned, parts lost, scrambled or doubled,"
        " swapped for another, or edited. Refused: in a message that names the file. Same: read as"
        " before. Changed: a file of the user's own that is as sound as it was, with another number"
        " or pixel, say, which nothing can tell from the one that was meant. What the project"
        " writes itself is sealed: there, a change that is not refused counts as lost.",
    ),
    "kills": (
        "Ends at any moment",
        "A small study from design to report, all of its processes killed (SIGKILL) at random"
        " moments, half of them while a file was being written; the same command then goes on."
        " Survived: nothing was done by hand, and in the end all bytes are those of an undisturbed"
        " run. By the stage that was at work.",
    ),
    "places": (
        "Places and circumstances",
        "Stages and whole runs where they cannot write, or on odd ground. Survived: the result has"
        " the same bytes; or, where there can be none, one message with a remedy, and all files are"
        " as they were.",
    ),
}


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
    paths = {name: args.out_dir / f"{name}.json" for name in _TOLD}
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
    title, text = _TOLD[name]
    heads = ["what", *columns]
    return SurvivalTable(
        name, title, text, heads, rows, total, told["faults"], told["seed"], told["commit"]
    )
