"""Builds the report of several studies on one page: figure (PDF, SVG, PNG), facts, tables."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pipeline.problem.reading import joint_figure
from pipeline.runtime import cli
from reports.base import joined
from reports.figures.several_studies import content, studies
from reports.page import publishing


def _work(args: argparse.Namespace) -> None:

    asked = joint_figure.load_joint_figure(args.figure)
    shown = studies.load(args.figure, asked, args.preset, args.results)
    publishing.publish(content.parts(args.figure.resolve().parent.name, asked, shown), args.out_dir)


def main(argv: Sequence[str] | None = None) -> int:
    """Build the report; returns the exit code."""
    parser = cli.parser("reports.figures.several_studies.build", str(__doc__), study=False)
    parser.add_argument("--figure", type=Path, required=True, metavar="YAML", help="the studies")
    parser.add_argument("--preset", metavar="NAME", help="a preset that all of them have")
    joined(parser)
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
