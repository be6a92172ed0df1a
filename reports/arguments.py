"""Options that several commands of the reports have."""

from __future__ import annotations

import argparse
from pathlib import Path


def joined(parser: argparse.ArgumentParser) -> None:
    """Adds those of a page of several studies: where their datasets are, and where it goes."""
    for name, told in (
        ("--results", "where their datasets are"),
        ("--out-dir", "the report's folder"),
    ):
        parser.add_argument(name, type=Path, required=True, metavar="FOLDER", help=told)
