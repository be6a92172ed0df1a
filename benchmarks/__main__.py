"""Command line: ``python -m benchmarks [name ...]``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks import registry
from benchmarks.harness import (
    Benchmark,
    BenchmarkReport,
    CandidateError,
    CandidateResult,
    comparison,
    measure,
    pin,
    storage,
    text_table,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Measures, prints and stores; returns the exit code (1 if something could not be measured)."""
    asked = _parser().parse_args(arguments)
    try:
        core = pin(asked.core)
        chosen = registry.load(asked.names)
    except ValueError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    good = True
    for benchmark in chosen:
        yard = comparison.yardstick()
        try:
            report = _report(benchmark, asked.repeats, asked.skip_baseline, asked.out, core)
        except CandidateError as failed:
            print(f"error: {benchmark.name}: no reference: {failed}", file=sys.stderr)
            good = False
            continue
        print(f"\n{text_table.text(report)}\n")
        print("  stored:", *storage.write(report, asked.out), flush=True)
        made = comparison.record(report, yard)
        print(comparison.told(benchmark.name, made), flush=True)
        if asked.keep:
            comparison.keep(benchmark.name, made)
        good = good and not any(outcome.failure for outcome in report.outcomes)
    return 0 if good else 1


def _report(
    benchmark: Benchmark, repeats: int, skip_baseline: bool, folder: Path, core: int
) -> BenchmarkReport:
    machine = storage.machine(core)
    chosen = [one for one in benchmark.candidates if not (skip_baseline and one.baseline)]
    measured = {
        outcome.name: outcome for outcome in measure(benchmark, chosen, repeats, tell=_tell)
    }
    known: dict[str, CandidateResult] = {
        **storage.stored_outcomes(benchmark.name, folder),
        **measured,
    }
    ordered = tuple(known[one.name] for one in benchmark.candidates if one.name in known)
    return BenchmarkReport(benchmark, ordered, machine)


def _tell(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description="Measures run time, error and memory of the solvers side by side on one core.",
        epilog=f"benchmarks: {', '.join(registry.names())}",
    )
    parser.add_argument("names", nargs="*", metavar="name", help="which; all short ones by default")
    parser.add_argument("--repeats", type=int, default=5, help="rounds (default %(default)s)")
    parser.add_argument("--core", type=int, help="core to run on (default: the last)")
    parser.add_argument(
        "--skip-baseline",
        action="store_true",
        help="show the slow baselines' stored figures, marked so, if there are any",
    )
    parser.add_argument(
        "--keep",
        action="store_true",
        help=f"store this as what later ones are compared with ({comparison.STORED.name})",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("results/benchmark"), help="folder (default %(default)s)"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
