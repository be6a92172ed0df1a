"""Measures suites side by side, prints them, and writes a dataset of each: `python -m benchmarks`.

Its times are those of this machine now: unlike all other datasets these are not byte-reproducible.
"""

import argparse
import logging
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import xarray as xr

from benchmarks.harness import (
    CandidateError,
    MeasuringLimits,
    Suite,
    comparison,
    pin,
    storage,
    text_table,
)
from benchmarks.suites import VIDEOS, suites
from pipeline.runtime import cli

LOG = logging.getLogger("pipeline.benchmarks")


def main(argv: Sequence[str] | None = None) -> int:
    """Measures; returns the exit code (1 if something in turn could not be measured)."""
    failed: list[str] = []
    return cli.run(partial(_work, failed), _parser(), argv) or int(bool(failed))


def _work(failed: list[str], args: argparse.Namespace) -> None:
    """Measures every suite; those without a reference or a figure are appended to ``failed``."""
    chosen = suites(args.names, args.videos)
    alone = args.core is not None or any(suite.in_turn for suite in chosen)
    core = pin(args.core) if alone else None
    for suite in chosen:
        try:
            if not _measured(suite, args, core):
                failed.append(suite.name)
        except CandidateError as error:
            LOG.error("error: %s: no reference: %s", suite.name, error)
            failed.append(suite.name)


def _measured(suite: Suite, args: argparse.Namespace, core: int | None) -> bool:
    """Measures, prints and writes a suite; tells whether all that runs in turn has figures."""
    yard = comparison.yardstick() if suite.in_turn else 0.0
    about = storage.machine(core)
    limits = MeasuringLimits(args.repeats, args.limit)
    if args.skip_baseline:
        path = args.out / f"{suite.name}.nc"
        stored = storage.stored_measurements(path, suite.baselines)
        limits = replace(limits, skipped=suite.baselines, stored=stored)
    measured = suite.measure(limits, lambda line: LOG.info("%s: %s", suite.name, line))
    bounds = {"repeats": args.repeats, "limit_s": args.limit}
    path = storage.write(suite, measured, about, bounds, args.out)
    if isinstance(measured, xr.Dataset):
        return True
    if not args.quiet:
        print(f"\n{text_table.text(suite, measured, about)}\n\n  stored: {path}", flush=True)
    if not suite.in_turn:
        return True
    fresh = [one for one in measured if one.method not in limits.skipped]
    made = comparison.record(fresh, about, yard)
    print(comparison.comparison_text(suite.name, made, skipped=limits.skipped), flush=True)
    if args.keep:
        comparison.keep(suite.name, made)
    return not any(one.failure for one in measured)


def _parser() -> argparse.ArgumentParser:
    limits, made = MeasuringLimits(), cli.parser("benchmarks", str(__doc__), study=False)
    made.add_argument("names", nargs="*", metavar="name", help="suites; all short ones by default")
    for option, kind, value, told in (
        ("--repeats", int, limits.repeats, "rounds, or runs of a setting"),
        ("--limit", float, limits.limit_s, "processor time that a run of a setting may take, s"),
        ("--core", int, None, "core to run on: the last for what runs in turn"),
        ("--videos", Path, VIDEOS, "folder of videos with truth, for the suite tracking"),
        ("--out", Path, Path("results/benchmark"), "folder of the datasets"),
    ):
        made.add_argument(option, type=kind, default=value, help=f"{told} (default %(default)s)")
    for option, told in (
        ("--skip-baseline", "show the slow baselines' stored figures, marked so, if there are any"),
        ("--keep", f"store this as what later ones are compared with ({comparison.STORED.name})"),
    ):
        made.add_argument(option, action="store_true", help=told)
    return made


if __name__ == "__main__":
    sys.exit(main())
