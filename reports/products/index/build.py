"""Builds the index page over all reports, datasets, packages and recordings that are there."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pipeline.runtime import cli, write_atomically
from reports.products.index import content


def _work(args: argparse.Namespace) -> None:

    with write_atomically(args.results / "index.html") as aside:
        aside.write_text(content.page(args.results), encoding="utf-8", newline="\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Build the page; returns the exit code."""
    parser = cli.parser("reports.products.index.build", str(__doc__), study=False)
    parser.add_argument(
        "--results", type=Path, default=Path("results"), metavar="FOLDER", help="(%(default)s)"
    )
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
