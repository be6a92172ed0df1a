"""Stage: measures one suite and writes its points, with units, as a dataset.

Its times are those of this machine now: unlike all other datasets it is not byte-reproducible.
"""

from __future__ import annotations

import argparse
import json
import logging
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from benchmarks.harness import CandidateError, MeasuringLimits, storage
from benchmarks.studies import catalogue
from pipeline import datasets
from pipeline.datasets import provenance
from pipeline.runtime import UserError, cli

LOG = logging.getLogger("pipeline.benchmarks")
VIDEOS = Path("tests/data/tracking")


def parser() -> argparse.ArgumentParser:
    """The stage's command line."""
    made = cli.parser("benchmarks.stage", str(__doc__), study=False)
    made.add_argument("suite", help="which: precision_fig2, growth, ablation, ...")
    made.add_argument("--out", type=Path, required=True, metavar="NC", help="dataset to write")
    made.add_argument(
        "--videos", type=Path, default=VIDEOS, metavar="FOLDER",
        help="videos with truth, for the suite tracking (default: %(default)s)",
    )  # fmt: skip
    made.add_argument(
        "--repeats", type=int, default=MeasuringLimits().repeats, help="runs of a point"
    )
    made.add_argument(
        "--limit", type=float, default=MeasuringLimits().limit_s, metavar="S",
        help="processor time that a run may take, s",
    )  # fmt: skip
    return made


def work(args: argparse.Namespace) -> None:
    """Measures and writes.

    Raises:
        UserError: there is no such suite, or its reference cannot be computed.
    """
    suite = catalogue.named(args.suite, args.videos)
    rules = MeasuringLimits(args.repeats, args.limit)
    machine = storage.machine()
    try:
        measured = suite.measure(rules, LOG.info)
    except CandidateError as failed:
        raise UserError(
            f"no reference: {failed}", key="suite", value=args.suite, remedy="see its log"
        ) from failed
    told = {"subject": suite.subject, "reference": suite.reference}
    described = measured.assign_attrs(told | {"machine": json.dumps(machine, sort_keys=True)})
    rules_told = json.dumps({"suite": args.suite, **asdict(rules)}, sort_keys=True)
    origin = provenance.of_recording(rules_told, {}, synthetic=False, role="rules")
    datasets.write(described, args.out, suite.kind, origin)


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    return cli.run(work, parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
