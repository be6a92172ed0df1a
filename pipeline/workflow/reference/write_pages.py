"""Writes the pages of the documentation that follow from the code."""

import argparse

from pipeline.workflow.reference import api_page, dataset_pages, key_pages


def pages() -> dict[str, str]:
    """Makes the pages, by the names of their files."""
    return {**key_pages.pages(), "datasets.md": dataset_pages.page(), "api.md": api_page.page()}


def work(args: argparse.Namespace) -> None:
    """Writes them."""
    for name, text in pages().items():
        (args.folder / name).write_text(text, encoding="utf-8")
