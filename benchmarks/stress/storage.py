"""The outcomes as a text table, and as JSON that the page shows."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.harness import aligned
from benchmarks.stress.verdicts import Check, Tally
from pipeline.runtime import write_atomically

SCHEMA_VERSION = 1


def table(tallies: Sequence[Tally]) -> str:
    """Counts of each family, and of all."""
    rows = [["family", "tried", "solved", "refused", "wrong", "in range", "of these solved", ""]]
    rows += [[tally.family.name, *map(str, _numbers(tally)), ""] for tally in tallies]
    totals = [sum(column) for column in zip(*map(_numbers, tallies), strict=True)]
    return aligned([*rows, ["all", *map(str, totals), ""]])


def _numbers(tally: Tally) -> tuple[int, ...]:
    verdicts = (tally.counts[verdict] for verdict in ("solved", "refused", "wrong"))
    return (len(tally.outcomes), *verdicts, *tally.in_range)


def write(tallies: Sequence[Tally], path: Path) -> None:
    """Writes the counts, the worst checks and the refusals of every family."""
    record = {
        "schema_version": SCHEMA_VERSION,
        "families": [_record(tally) for tally in tallies],
    }
    with write_atomically(path) as aside:
        aside.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def _record(tally: Tally) -> dict[str, Any]:
    tried, solved, refused, wrong, in_range, in_range_solved = _numbers(tally)
    return {
        "name": tally.family.name,
        "tried_what": tally.family.tried,
        "judged_how": tally.family.judged,
        "tried": tried,
        "solved": solved,
        "refused": refused,
        "wrong": wrong,
        "in_range": in_range,
        "in_range_solved": in_range_solved,
        "worst": [_check(check) for check in tally.worst],
        "not_solved": [
            {
                "case": outcome.case.name,
                "verdict": outcome.verdict,
                "wanted": outcome.case.wanted,
                "message": outcome.message,
            }
            for outcome in tally.outcomes
            if outcome.verdict != "solved"
        ],
    }


def _check(check: Check) -> dict[str, Any]:
    return {"name": check.name, "value": float(f"{check.value:.2e}"), "limit": float(check.limit)}
