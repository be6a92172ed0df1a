"""Builds the report of several designs of one problem: figure (PDF, SVG, PNG), facts, tables."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from pipeline import cli
from reports.arguments import joined


def _work(args: argparse.Namespace) -> None:
    from reports import publishing
    from reports.family import content, designs

    found = designs.load(args.problem, args.preset, args.results)
    publishing.publish(content.parts(found), args.out_dir)


def main(argv: Sequence[str] | None = None) -> int:
    """Build the report; returns the exit code."""
    parser = cli.parser("reports.family.build", str(__doc__))
    joined(parser)
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
