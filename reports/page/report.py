"""Writes the files of a report so that a reader never meets half of one.

They are made in a folder beside the wanted one and moved in when all of them are whole.
"""

import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pipeline.datasets import file_hash
from pipeline.runtime import refusal, write_atomically
from reports.base import Table, style
from reports.facts import Fact, fact_records
from reports.page import templating


@dataclass(frozen=True)
class Report:
    """Holds figures, tables and facts, and the page that shows them."""

    figures: Mapping[str, Callable[[], Figure]] = field(default_factory=dict)  # by name of file
    # of the page; none makes no page. It gets `values`, `tables`, of every figure its SVG (`svgs`)
    # and the names of its files (`drawn`), and of the first one `svg`, `files`.
    template: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)  # what else the template shows, by name
    tables: Sequence[Table] = ()  # written as CSV
    facts: Sequence[Fact] = ()  # written as JSON


def publish(report: Report, folder: Path) -> list[Path]:
    """Makes a report aside and moves its files into `folder`, the page last; returns their paths.

    Raises:
        UserError: the folder is full, read-only or not ours.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with _aside(folder) as aside:
            return [_moved(path, folder) for path in _write(report, aside)]
    except OSError as error:
        raise refusal(folder, error) from error


def write_page(path: Path, template: str, values: Mapping[str, Any]) -> None:
    """Writes one page, whole or not at all.

    Raises:
        UserError: the folder is full, read-only or not ours.
    """
    text = templating.rendered(template, values)
    with write_atomically(path) as aside:
        aside.write_text(text, encoding="utf-8", newline="\n")


def _write(report: Report, folder: Path) -> list[Path]:
    drawn: dict[str, list[Path]] = {}
    for name, draw in report.figures.items():
        with style.styled():
            drawn[name] = style.save(draw(), folder / name)
    written = [path for paths in drawn.values() for path in paths]
    seal = ""
    if report.facts:
        fact_records.write_json(report.facts, folder / "facts.json")
        written.append(folder / "facts.json")
        seal = file_hash(folder / "facts.json")
    for table in report.tables:
        (folder / table.name).write_bytes(table.csv)
        written.append(folder / table.name)
    if report.template:
        page = folder / "index.html"
        page.write_text(rendered(report, drawn, seal), encoding="utf-8", newline="\n")
        written.append(page)
    return written


def rendered(report: Report, drawn: Mapping[str, Sequence[Path]], facts_sha256: str = "") -> str:
    """Returns the HTML of a report, whose figures lie in the files `drawn`; it seals its facts."""
    svgs = {
        name: templating.inlined(path.read_text(encoding="utf-8"))
        for name, paths in drawn.items()
        for path in paths
        if path.suffix == ".svg"
    }
    files = {name: [path.name for path in paths] for name, paths in drawn.items()}
    first = next(iter(report.figures), "")
    shown = {
        "svgs": svgs,
        "svg": svgs.get(first, ""),
        "drawn": files,
        "files": files.get(first, []),
        "facts_sha256": facts_sha256,
    }
    return templating.rendered(report.template, {"tables": report.tables, **shown, **report.values})


@contextmanager
def _aside(folder: Path) -> Iterator[Path]:
    """Makes an empty folder beside `folder`, gone at the end, in place of one left there."""
    aside = folder.with_name(f".{folder.name}.part")
    if aside.exists():
        shutil.rmtree(aside)
    aside.mkdir()
    try:
        yield aside
    finally:
        shutil.rmtree(aside)


def _moved(path: Path, folder: Path) -> Path:
    """Returns the file in `folder`, safe on the disk before it shows under its name."""
    with path.open("rb") as file:
        os.fsync(file.fileno())
    return path.replace(folder / path.name)
