"""Writes the pages of the documentation that follow from the code."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pipeline.runtime import cli


def pages() -> dict[str, str]:
    """The pages, by the names of their files."""
    from pipeline.workflow.reference import dataset_pages, key_pages

    return {**key_pages.pages(), "datasets.md": dataset_pages.page()}


def work(args: argparse.Namespace) -> None:
    """Writes them."""
    for name, text in pages().items():
        (args.folder / name).write_text(text, encoding="utf-8")


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    parser = cli.parser("pipeline.workflow.reference", str(__doc__), study=False)
    parser.add_argument(
        "--folder", type=Path, default=Path("docs"), help="where they go (default: %(default)s)"
    )
    return cli.run(work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
