"""Tells the counts of the stress suite: one page, and its table as CSV."""

import argparse
import json
from pathlib import Path
from typing import Any

from pipeline.runtime import UserError
from reports.base import Table
from reports.page import Report, publish

COLUMNS = ("tried", "solved", "refused", "wrong", "in_range", "in_range_solved")


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    families = _families(args.counts)
    columns = {key: [each[key] for each in families] for key in ("name", *COLUMNS)}
    totals = {key: sum(columns[key]) for key in COLUMNS}
    values = {"families": families, "totals": totals, "share": _share(totals)}
    table = Table("stress.csv", "Counts of every family", columns)
    publish(Report({}, "stress.html.j2", values, [table]), args.out_dir)


def _families(path: Path) -> list[dict[str, Any]]:
    try:
        families = json.loads(path.read_text(encoding="utf-8"))["families"]
        return [each | {key: int(each[key]) for key in COLUMNS} for each in families]
    except (OSError, ValueError, KeyError, TypeError) as error:
        what = f"no counts of the stress suite: {error!r}"
        remedy = "make them with python -m benchmarks.stress"
        raise UserError(what, file=path, remedy=remedy) from error


def _share(totals: dict[str, int]) -> str:
    """Returns solved cases in range, in percent, never rounded up to all of them."""
    tenths = 1000 * totals["in_range_solved"] // max(totals["in_range"], 1)
    return f"{tenths / 10:.1f} %"
