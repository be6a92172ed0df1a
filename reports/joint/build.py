"""Builds the report of several studies on one page: figure (PDF, SVG, PNG), facts, tables."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pipeline import cli
from reports.arguments import joined


def _work(args: argparse.Namespace) -> None:
    from pipeline.problem import joint
    from reports import publishing
    from reports.joint import content, studies

    asked = joint.load(args.figure)
    shown = studies.load(args.figure, asked, args.preset, args.results)
    publishing.publish(content.parts(args.figure.resolve().parent.name, asked, shown), args.out_dir)


def main(argv: Sequence[str] | None = None) -> int:
    """Build the report; returns the exit code."""
    parser = cli.parser("reports.joint.build", str(__doc__), study=False)
    parser.add_argument("--figure", type=Path, required=True, metavar="YAML", help="the studies")
    parser.add_argument("--preset", metavar="NAME", help="a preset that all of them have")
    joined(parser)
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
