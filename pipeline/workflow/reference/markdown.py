"""Formats tables of Markdown, and the text above them."""

from collections.abc import Iterable, Sequence
from pathlib import Path


def head(module: str, **values: object) -> str:
    """Reads what stands above all else on the page of a module, given its `__file__`."""
    return Path(module).with_suffix(".md").read_text(encoding="utf-8").format(**values)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Formats a table with a line for each row."""
    lines = [heads, ["---"] * len(heads), *rows]
    cells = ([text.replace("|", "\\|") for text in line] for line in lines)
    return "".join("| " + " | ".join(line) + " |\n" for line in cells)
