"""Tells what was tried to lose or to spoil results: tables of tried and survived."""

import argparse
import json
from pathlib import Path
from typing import Any

from reports.base import prose
from reports.page import write_page

_PROSE = prose(__file__)


def report(args: argparse.Namespace) -> None:
    """Writes ``index.html`` over the JSON files in a folder, one for each part that was tried."""
    paths = {name: args.out_dir / f"{name}.json" for name in _PROSE}
    parts = [_part(name, path) for name, path in paths.items() if path.is_file()]
    totals = [sum(part["total"][k] for part in parts) for k in (1, 2)]
    values = {"parts": parts, "totals": totals}
    write_page(args.out_dir / "index.html", "survival.html.j2", values)


def _part(name: str, path: Path) -> dict[str, Any]:
    """Tells what the page shows of a part: what was tried, a table with its sums, the faults."""
    told = json.loads(path.read_text(encoding="utf-8"))
    details = [key for key in told["rows"][0] if key not in ("what", "tried", "survived")]
    columns = ["tried", "survived", *details]
    rows = [[row["what"], *(row[key] for key in columns)] for row in told["rows"]]
    total = ["all", *(sum(row[key] for row in told["rows"]) for key in columns)]
    about = {key: told[key] for key in ("faults", "seed", "commit")} | _PROSE[name]
    return {"name": name, "columns": ["what", *columns], "rows": rows, "total": total, **about}
