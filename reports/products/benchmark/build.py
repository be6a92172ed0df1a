"""Builds the page on benchmarks: a picture, a table and what failed, of every dataset given."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pipeline.runtime import cli
from reports.page import publishing
from reports.products.benchmark import content


def _work(args: argparse.Namespace) -> None:

    publishing.published(lambda aside: content.write(args.datasets, aside), args.out_dir)


def main(argv: Sequence[str] | None = None) -> int:
    """Build the page; returns the exit code."""
    parser = cli.parser("reports.products.benchmark.build", str(__doc__), study=False)
    parser.add_argument(
        "--datasets", type=Path, nargs="+", required=True, metavar="NC", help="what was measured"
    )
    parser.add_argument(
        "--out-dir", type=Path, required=True, metavar="FOLDER", help="the page's folder"
    )
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
