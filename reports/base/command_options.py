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


def drawn(parser: argparse.ArgumentParser, dataset: str) -> None:
    """The dataset that a page is drawn from, as `--DATASET`, and the folder for its files."""
    parser.add_argument(f"--{dataset}", type=Path, required=True, metavar="NC", help="the dataset")
    parser.add_argument("--out-dir", type=Path, required=True, metavar="DIR", help="for all files")
