"""Builds the report of a study: figure (PDF, SVG, PNG), page, facts and data tables.

The same datasets give the same bytes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.runtime import cli
from reports.facts import fact_records
from reports.figures import kinds
from reports.page import publishing

if TYPE_CHECKING:
    from pipeline.problem import Output
    from reports.study import StudyResults

REQUIRED: tuple[Output, ...] = ("design", "response")
OPTIONAL: tuple[Output, ...] = (
    "sweep",
    "scatter",
    "verification",
    "geometric_design",
    "geometric_response",
)


def publish(study: StudyResults, folder: Path) -> list[Path]:
    """Make the report of a study in `folder`; returns the paths of its files, page last.

    Raises:
        UserError: the folder is full, read-only or not ours.
    """
    kind = kinds.kind_of(study.problem)
    known = fact_records.quoted(kind.facts(study), study.problem.report.paper)
    tables = [fact_records.table(known), *kind.tables(study)]
    parts = publishing.ReportParts(
        study.name,
        known,
        tables,
        lambda: kind.figure(study),
        lambda svg, files: kind.page(study, known, tables, svg, files),
    )
    return publishing.publish(parts, folder)


def _work(args: argparse.Namespace) -> None:
    from reports.study import study_results as study

    given: dict[Output, Path] = {
        name: path for name in (*REQUIRED, *OPTIONAL) if (path := getattr(args, name)) is not None
    }
    publish(study.load(args.problem, args.preset, given, args.comparisons), args.out_dir)


def main(argv: Sequence[str] | None = None) -> int:
    """Build the report; returns the exit code."""
    parser = cli.parser("reports.figures.study_report", str(__doc__))
    for name in (*REQUIRED, *OPTIONAL):
        parser.add_argument(
            f"--{name.replace('_', '-')}",
            type=Path,
            required=name in REQUIRED,
            metavar="NC",
            help=f"the {name} dataset" + ("" if name in REQUIRED else ", if the problem has one"),
        )
    parser.add_argument(
        "--comparisons", type=Path, nargs="*", default=(), metavar="NC",
        help="its recordings beside their simulation, each in a folder of the recording's name",
    )  # fmt: skip
    parser.add_argument(
        "--out-dir", type=Path, required=True, metavar="FOLDER", help="the report's folder"
    )
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
