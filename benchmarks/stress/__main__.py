"""Tries to break the numbers: every case must be solved, or refused in words.

Command line: ``python -m benchmarks.stress [family ...]``. All of its counts go to JSON, which
the page shows; those of a part go only to a file that is named.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.harness import aligned
from benchmarks.stress import families
from benchmarks.stress.verdicts import StressFamily, Tally, run_attempt
from pipeline.runtime import write_atomically

ENOUGH = 0.99
"""Share of the cases in range that must be solved, of each family and of all."""
TRIES = 100
"""Tries of a family of random scenes."""
COUNTS = Path("results/stress/stress.json")
"""The counts that the page shows."""
SCHEMA_VERSION = 1
FAMILIES: dict[str, StressFamily] = {
    family.name: family
    for family in (
        *(families.barrier, families.designs, families.slender, families.constants),
        *(families.times, families.windings, families.sizes, families.pieces, families.inputs),
        *(families.branches, families.balances, families.symmetry, families.agreement),
        *(families.skips, families.drives, families.pulses, families.grids, families.bifurcations),
    )
}
"""In the order of the table."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Attempts all cases, prints and stores the counts.

    Returns:
        1 if an answer is wrong or too few cases in range are solved, otherwise 0.
    """
    args = _parser().parse_args(arguments)
    if unknown := sorted(set(args.names) - set(FAMILIES)):
        known = ", ".join(FAMILIES)
        print(f"error: no family {', '.join(unknown)}; there are {known}", file=sys.stderr)
        return 2
    chosen = [family for name, family in FAMILIES.items() if not args.names or name in args.names]
    tallies = [_tally(family, args) for family in chosen]
    if args.out is not None or _is_complete(args):
        _store(tallies, args.out or COUNTS)
    else:
        _print_line(f"a part of the suite: {COUNTS} stays as it is; --out stores these counts")
    print(table(tallies))
    failures = [line for tally in tallies for line in _failures(tally)]
    print(*failures, sep="\n")
    return 1 if failures and not args.tolerant else 0


def _is_complete(args: argparse.Namespace) -> bool:
    """Tests if no family, case or try is left out."""
    return not (args.names or args.small or args.only) and args.tries >= TRIES


def _store(tallies: Sequence[Tally], path: Path) -> None:
    """Writes the counts of families as JSON."""
    record = {"schema_version": SCHEMA_VERSION, "families": [_record(each) for each in tallies]}
    with write_atomically(path) as aside:
        aside.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def _tally(family: StressFamily, args: argparse.Namespace) -> Tally:
    """Attempts the cases of a family, and tells of those that are not solved."""
    start, outcomes = time.process_time(), []
    drawn = (
        (args.first, args.first + args.tries) if family.endless and not args.small else (0, None)
    )
    for case in islice(family.cases(args.small), *drawn):
        if args.only in case.name:
            outcomes.append(outcome := run_attempt(case))
            if outcome.verdict != "solved":
                _print_line(f"{family.name}: {case.name}: {outcome.verdict}: {outcome.message}")
    _print_line(f"{family.name}: {len(outcomes)} cases, {time.process_time() - start:.0f} s")
    return Tally(family, tuple(outcomes))


def _print_line(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _failures(tally: Tally) -> Iterator[str]:
    tried, solved = tally.in_range
    for outcome in tally.outcomes:
        if outcome.verdict == "wrong":
            yield f"wrong: {tally.family.name}: {outcome.case.name}: {outcome.message}"
    for share, value, limit in zip(("median", "95 %"), tally.overstated, (5.0, 50.0), strict=True):
        if value > limit:
            yield f"overstated: {tally.family.name}: {share} {value:.3g} times the true error"
    if solved < ENOUGH * tried:
        yield f"too few solved: {tally.family.name}: {solved} of {tried} in range"


def table(tallies: Sequence[Tally]) -> str:
    """Formats the counts of each family, and of all."""
    head = ["family", "tried", "solved", "refused", "wrong", "in range", "of these solved", ""]
    counts = {tally.family.name: [*_counts(tally).values()] for tally in tallies}
    counts["all"] = [sum(column) for column in zip(*counts.values(), strict=True)]
    return aligned([head, *([name, *map(str, row), ""] for name, row in counts.items())])


def _counts(tally: Tally) -> dict[str, int]:
    in_range, in_range_solved = tally.in_range
    verdicts = {verdict: tally.counts[verdict] for verdict in ("solved", "refused", "wrong")}
    of_range = {"in_range": in_range, "in_range_solved": in_range_solved}
    return {"tried": len(tally.outcomes), **verdicts, **of_range}


def _record(tally: Tally) -> dict[str, Any]:
    """Collects the counts, the worst checks and the refusals of a family."""
    return {
        "name": tally.family.name,
        "tried_what": tally.family.tried,
        "judged_how": tally.family.judged,
        **_counts(tally),
        "stated_over_true": [None if np.isnan(each) else each for each in tally.overstated],
        "worst": [
            {"name": name, "value": float(f"{value:.2e}"), "limit": float(limit)}
            for name, value, limit, _ in tally.worst
        ],
        "not_solved": [
            {"case": case.name, "verdict": verdict, "wanted": case.expected, "message": message}
            for case, verdict, message, _ in tally.outcomes
            if verdict != "solved"
        ],
    }


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.stress",
        description="Tries to break the numbers: every case must be solved, or refused in words.",
        epilog=f"families: {', '.join(FAMILIES)}",
    )
    add = parser.add_argument
    add("names", nargs="*", metavar="family", help="which; all by default")
    add("--small", action="store_true", help="a few cases of each family")
    add("--tries", type=int, default=TRIES, metavar="N", help="of a random family (%(default)s)")
    add("--first", type=int, default=0, metavar="SEED", help="of these tries (%(default)s)")
    add("--tolerant", action="store_true", help="end well whatever is found: the page shows it")
    add("--only", default="", metavar="TEXT", help="cases with it in their name")
    add("--out", type=Path, help=f"the counts (of the whole suite {COUNTS}, of a part none)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
