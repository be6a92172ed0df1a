"""Formats measurements as text."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.harness.records import Measurement, Suite, Target, quantities


def text(suite: Suite, measured: list[Measurement], about: Mapping[str, Any]) -> str:
    """Formats title, table, notes and targets of one suite."""
    where = f"{about['processor']}, core {about['core']}, commit {about['commit'][:10]}"
    if about["changed_since_commit"]:
        where += f" and changes in {len(about['changed_since_commit'])} files"
    parts = [
        f"{suite.name}: {suite.subject}",
        where,
        table(measured),
        *(f"  {one.name}: no figures: {one.failure}" for one in measured if one.failure),
        *(f"  {one.name}: {one.note}" for one in measured if one.note),
        *(f"  {target_line(*verdict)}" for verdict in suite.verdicts(measured)),
    ]
    return "\n".join(parts)


def table(measured: list[Measurement]) -> str:
    """Formats measurements, one a row; times in seconds of one core."""
    columns = quantities(measured)
    head = ["candidate", "time s", "spread", "clock s", "compile s", *(f"{k} err" for k in columns)]
    rows = [[*head, "peak MiB", "work"]]
    for one in measured:
        wall = float(np.median(one.wall_s)) if one.wall_s else float("nan")
        figures = [number(one.seconds), percent(one.spread), number(wall), number(one.compile_s)]
        misses = [number(one.error(name), digits=2) for name in columns]
        work = ", ".join(f"{count} {what}" for what, count in one.work.items())
        rows.append([one.name, *figures, *misses, number(one.peak_mib), work])
    return aligned(rows)


def target_line(target: Target, value: float, verdict: str) -> str:
    """Formats one target as a line that ends in its verdict."""
    sign, limit = ("<=", target.at_most) if target.at_most is not None else (">=", target.at_least)
    aim = "" if target.aim is None else f" (aim {target.aim:g})"
    unit = f" {target.unit}" if target.unit else ""
    return f"{target.name}: {number(value)}{unit}, target {sign} {limit:g}{aim}: {verdict}"


def number(value: float, digits: int = 3) -> str:
    """Formats a figure to a few digits, "-" for none."""
    if np.isnan(value):
        return "-"
    return f"{value:.{digits}g}" if not 1e3 <= abs(value) < 1e6 else f"{value:.0f}"


def percent(value: float) -> str:
    """Formats a relative spread."""
    return "-" if np.isnan(value) else f"{100 * value:.0f} %"


def aligned(rows: Sequence[Sequence[str]]) -> str:
    """Aligns rows in columns: the first and the last to the left, figures to the right."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    last = len(widths) - 1
    lines = []
    for row in rows:
        cells = [
            cell.ljust(width) if k in (0, last) else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  " + "  ".join(cells).rstrip())
    lines.insert(1, "  " + "-" * (len(lines[0]) - 2))
    return "\n".join(lines)
