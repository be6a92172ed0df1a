"""A report as text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from benchmarks.harness.records import BenchmarkReport, CandidateResult, Target, column


def text(report: BenchmarkReport) -> str:
    """Title, table, notes and targets of one benchmark."""
    machine = report.machine
    where = f"{machine['processor']}, core {machine['core']}, commit {machine['commit'][:10]}"
    if machine["changed_since_commit"]:
        where += f" and changes in {len(machine['changed_since_commit'])} files"
    parts = [
        f"{report.benchmark.name}: {report.benchmark.title}",
        where,
        table(report.outcomes),
        *(f"  {line}" for line in notes(report.outcomes)),
        *(f"  {target_line(*verdict)}" for verdict in report.verdicts),
    ]
    return "\n".join(parts)


def table(outcomes: Sequence[CandidateResult]) -> str:
    """Figures of the candidates, one a row; times in seconds of one core."""
    kinds = error_columns(outcomes)
    head = ["candidate", "time s", "spread", "clock s", "compile s", *(f"{k} err" for k in kinds)]
    rows = [[*head, "peak MiB", "work"]]
    for one in outcomes:
        wall = float(np.median(one.wall_s)) if one.wall_s else float("nan")
        figures = [number(one.seconds), percent(one.spread), number(wall), number(one.compile_s)]
        misses = [number(one.error(kind), digits=2) for kind in kinds]
        work = ", ".join(f"{count} {what}" for what, count in one.work.items())
        rows.append([one.name, *figures, *misses, number(one.peak_mib), work])
    return aligned(rows)


def error_columns(outcomes: Iterable[CandidateResult]) -> list[str]:
    """Kinds of errors that any candidate has, in order of appearance."""
    return list(dict.fromkeys(column(name) for one in outcomes for name in one.errors))


def notes(outcomes: Iterable[CandidateResult]) -> list[str]:
    """What must be known about single rows."""
    lines = []
    for one in outcomes:
        if one.failure:
            lines.append(f"{one.name}: no figures: {one.failure}")
        if one.note:
            lines.append(f"{one.name}: {one.note}")
        if one.stored:
            lines.append(f"{one.name}: NOT measured now, figures of {one.stored}")
    return lines


def target_line(target: Target, value: float, verdict: str) -> str:
    """One target as a line that ends in its verdict."""
    sign, limit = ("<=", target.at_most) if target.at_most is not None else (">=", target.at_least)
    aim = "" if target.aim is None else f" (aim {target.aim:g})"
    unit = f" {target.unit}" if target.unit else ""
    return f"{target.name}: {number(value)}{unit}, target {sign} {limit:g}{aim}: {verdict}"


def number(value: float, digits: int = 3) -> str:
    """A figure to a few digits, "-" for none."""
    if np.isnan(value):
        return "-"
    return f"{value:.{digits}g}" if not 1e3 <= abs(value) < 1e6 else f"{value:.0f}"


def percent(value: float) -> str:
    """A relative spread."""
    return "-" if np.isnan(value) else f"{100 * value:.0f} %"


def aligned(rows: Sequence[Sequence[str]]) -> str:
    """Rows as columns of equal width: the first and the last to the left, figures to the right."""
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
