"""Command line: ``python -m benchmarks.stress [family ...]``."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.stress import registry, storage
from benchmarks.stress.verdicts import StressFamily, StressOutcome, Tally, attempted

ENOUGH = 0.99
"""Share of the cases in range that must be solved, of each family and of all."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Attempts all cases, prints and stores the counts.

    Returns:
        1 if an answer is wrong or too few cases in range are solved, otherwise 0.
    """
    asked = _parser().parse_args(arguments)
    try:
        families = registry.load(asked.names)
    except ValueError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    tallies = [_tally(family, asked.small, asked.only) for family in families]
    storage.write(tallies, asked.out)
    print(storage.table(tallies))
    failures = [line for tally in tallies for line in _failures(tally)]
    print(*failures, sep="\n")
    return 1 if failures and not asked.tolerant else 0


def _tally(family: StressFamily, small: bool, only: str) -> Tally:
    """Attempts the cases of a family, and tells of those that are not solved."""
    start, outcomes = time.process_time(), []
    for case in family.cases(small):
        if only in case.name:
            outcomes.append(attempted(case))
            _tell(family, outcomes[-1])
    spent = time.process_time() - start
    print(f"{family.name}: {len(outcomes)} cases, {spent:.0f} s", file=sys.stderr, flush=True)
    return Tally(family, tuple(outcomes))


def _tell(family: StressFamily, outcome: StressOutcome) -> None:
    if outcome.verdict != "solved":
        line = f"{family.name}: {outcome.case.name}: {outcome.verdict}: {outcome.message}"
        print(line, file=sys.stderr, flush=True)


def _failures(tally: Tally) -> list[str]:
    tried, solved = tally.in_range
    lines = [
        f"wrong: {tally.family.name}: {outcome.case.name}: {outcome.message}"
        for outcome in tally.outcomes
        if outcome.verdict == "wrong"
    ]
    if solved < ENOUGH * tried:
        lines.append(f"too few solved: {tally.family.name}: {solved} of {tried} in range")
    return lines


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.stress",
        description="Tries to break the numbers: every case must be solved, or refused in words.",
        epilog=f"families: {', '.join(registry.NAMES)}",
    )
    parser.add_argument("names", nargs="*", metavar="family", help="which; all by default")
    parser.add_argument("--small", action="store_true", help="a few cases of each family")
    parser.add_argument(
        "--tolerant", action="store_true", help="end well whatever is found: the page shows it"
    )
    parser.add_argument("--only", default="", metavar="TEXT", help="cases with it in their name")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("results/stress/stress.json"),
        help="the counts (default %(default)s)",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
