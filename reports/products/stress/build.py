"""Draws the counts of the stress suite: one page, and its table as CSV.

The same counts give the same bytes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline.runtime import UserError, cli
from reports.base import Table
from reports.page import publishing, templating

COLUMNS = ("tried", "solved", "refused", "wrong", "in_range", "in_range_solved")


def _work(args: argparse.Namespace) -> None:

    families = _families(args.counts)
    publishing.published(lambda aside: _write(families, aside), args.out_dir)


def _families(path: Path) -> list[dict[str, Any]]:
    """The record of every family.

    Raises:
        UserError: the file is none that the suite wrote.
    """
    import json

    try:
        families = json.loads(path.read_text(encoding="utf-8"))["families"]
        return [each | {key: int(each[key]) for key in COLUMNS} for each in families]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UserError(
            f"no counts of the stress suite: {error!r}",
            file=path,
            remedy="make them with python -m benchmarks.stress",
        ) from error


def _write(families: Sequence[dict[str, Any]], folder: Path) -> list[Path]:

    columns = {key: [each[key] for each in families] for key in ("name", *COLUMNS)}
    table = Table("stress.csv", "Counts of every family", columns)
    (folder / table.name).write_bytes(table.csv)
    totals = {key: sum(columns[key]) for key in COLUMNS}
    values = {"families": families, "totals": totals, "share": _share(totals)}
    text = templating.rendered("stress.html.j2", values)
    (folder / "index.html").write_text(text, encoding="utf-8", newline="\n")
    return [folder / table.name, folder / "index.html"]


def _share(totals: dict[str, int]) -> str:
    """Solved cases in range, in percent, never rounded up to all of them."""
    tenths = 1000 * totals["in_range_solved"] // max(totals["in_range"], 1)
    return f"{tenths / 10:.1f} %"


def main(argv: Sequence[str] | None = None) -> int:
    """Build the page; returns the exit code."""
    parser = cli.parser("reports.products.stress.build", str(__doc__), study=False)
    parser.add_argument("--counts", type=Path, required=True, metavar="JSON", help="of the suite")
    parser.add_argument("--out-dir", type=Path, required=True, metavar="FOLDER", help="of the page")
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
