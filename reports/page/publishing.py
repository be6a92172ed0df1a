"""Writes the files of a report so that a reader never meets half of one.

They are made in a folder beside the wanted one and moved in when all of them are whole.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from pipeline.runtime import refusal
from reports.base import Table, style
from reports.facts import Fact
from reports.facts import fact_records as facts
from reports.page import report_page as page
from reports.page.report_page import ReportPage


class ReportParts(NamedTuple):
    """What a report is made of.

    Attributes:
        name: of the files of the figure.
        facts: written as JSON.
        tables: written as CSV.
        figure: makes the figure, in the style of all.
        page: makes the page of the figure as SVG and the names of its files.
    """

    name: str
    facts: Sequence[Fact]
    tables: Sequence[Table]
    figure: Callable[[], Figure]
    page: Callable[[str, list[str]], ReportPage]


def publish(parts: ReportParts, folder: Path) -> list[Path]:
    """Make the report aside and move its files into `folder`, the page last.

    Raises:
        UserError: the folder is full, read-only or not ours.
    """
    return published(lambda aside: write(parts, aside), folder)


def draw(figure: Callable[[], Figure], name: str, folder: Path) -> list[Path]:
    """Make a figure alone, in the style of all; returns the paths of its files.

    Raises:
        UserError: the folder is full, read-only or not ours.
    """

    def drawn(aside: Path) -> list[Path]:
        with style.styled():
            return style.save(figure(), aside / name)

    return published(drawn, folder)


def published(make: Callable[[Path], list[Path]], folder: Path) -> list[Path]:
    """Let `make` write files into a folder aside, and move them into `folder` in their order.

    Raises:
        UserError: the folder is full, read-only or not ours.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with _aside(folder) as aside:
            return [_moved(path, folder) for path in make(aside)]
    except OSError as error:
        raise refusal(folder, error) from error


def write(parts: ReportParts, folder: Path) -> list[Path]:
    """Write all files of the report into an existing `folder`; returns their paths, page last."""
    facts.write_json(parts.facts, folder / "facts.json")
    for table in parts.tables:
        (folder / table.name).write_bytes(table.csv)
    with style.styled():
        drawn = style.save(parts.figure(), folder / parts.name)
    svg = (folder / f"{parts.name}.svg").read_text(encoding="utf-8")
    html = page.render(parts.page(svg, [path.name for path in drawn]))
    (folder / "index.html").write_text(html, encoding="utf-8")
    names = ["facts.json", *(table.name for table in parts.tables), "index.html"]
    return [*drawn, *(folder / name for name in names)]


@contextmanager
def _aside(folder: Path) -> Iterator[Path]:
    """An empty folder beside `folder`, gone at the end; what a killed build left there goes too."""
    aside = folder.with_name(f".{folder.name}.part")
    if aside.exists():
        shutil.rmtree(aside)
    aside.mkdir()
    try:
        yield aside
    finally:
        shutil.rmtree(aside)


def _moved(path: Path, folder: Path) -> Path:
    """The file in `folder`, safe on the disk before it shows under its name."""
    with path.open("rb") as file:
        os.fsync(file.fileno())
    return path.replace(folder / path.name)
