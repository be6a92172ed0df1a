"""Builds the report of several designs of one problem: figure (PDF, SVG, PNG), facts, tables."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from pipeline.runtime import cli
from reports.base import joined
from reports.figures.several_designs import content, designs
from reports.page import publishing


def _work(args: argparse.Namespace) -> None:

    found = designs.load(args.problem, args.preset, args.results)
    publishing.publish(content.parts(found), args.out_dir)


def main(argv: Sequence[str] | None = None) -> int:
    """Build the report; returns the exit code."""
    parser = cli.parser("reports.figures.several_designs.build", str(__doc__))
    joined(parser)
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
