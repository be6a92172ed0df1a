"""The page on benchmarks: a section for each picture, with what lies behind it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from pipeline import datasets
from reports.base import style
from reports.page import templating
from reports.products.benchmark import tables
from reports.products.benchmark.sections import OPTIMISERS, TRACKING, BenchmarkPicture, pictures
from reports.products.benchmark.tables import Failure


@dataclass(frozen=True)
class BenchmarkSection:
    """A picture as the page shows it.

    Attributes:
        picture: name, title and caption.
        svg: the picture.
        files: addresses of pictures, tables and datasets.
        references: what errors are measured against.
        points: tables, by the names of their files: heads and rows.
        failed: points without figures.
        provenance: attributes of the datasets, by their names.
    """

    picture: BenchmarkPicture
    svg: str
    files: Sequence[str]
    references: Sequence[str]
    points: Mapping[str, tuple[Sequence[str], Sequence[Sequence[str]]]]
    failed: Sequence[Failure]
    provenance: Mapping[str, Sequence[tuple[str, str]]]


def write(paths: Sequence[Path], folder: Path) -> list[Path]:
    """Writes pictures, tables and page into `folder`; returns their paths, the page last."""
    given = {path.stem: _read(path) for path in paths}
    written: list[Path] = []
    known: set[str] = set()
    sections = [_section(picture, folder, written, known) for picture in pictures(given)]
    page = folder / "index.html"
    values = {"sections": sections, "machines": _machines(given.values())}
    page.write_text(templating.rendered("benchmark.html.j2", values), encoding="utf-8")
    return [*written, page]


def _read(path: Path) -> xr.Dataset:
    if path.stem.startswith(OPTIMISERS):
        return datasets.read(path, "contest")
    return datasets.read(path, "tracking" if path.stem == TRACKING else "benchmark")


def _section(
    picture: BenchmarkPicture, folder: Path, written: list[Path], known: set[str]
) -> BenchmarkSection:
    """The section; tables that an earlier one has shown (`known`) are left out."""
    fresh = {name: data for name, data in picture.shown.items() if name not in known}
    known.update(fresh)
    with style.styled():
        made = style.save(picture.draw(), folder / picture.name)
    svg = (folder / f"{picture.name}.svg").read_text(encoding="utf-8")
    points = {}
    for name, data in fresh.items():
        table = tables.table(name, data)
        (folder / table.name).write_bytes(table.csv)
        made.append(folder / table.name)
        points[table.name] = (list(table.columns), list(tables.rows(table)))
    written += made
    return BenchmarkSection(
        picture=picture,
        svg=templating.inlined(svg),
        files=[*(path.name for path in made), *(f"{name}.nc" for name in picture.shown)],
        references=list(dict.fromkeys(data.attrs["reference"] for data in fresh.values())),
        points=points,
        failed=[one for data in fresh.values() for one in tables.failures(data)],
        provenance={name: _attributes(data) for name, data in fresh.items()},
    )


def _attributes(data: xr.Dataset) -> list[tuple[str, str]]:
    return sorted((str(key), str(value)) for key, value in data.attrs.items())


def _machines(given: Iterable[xr.Dataset]) -> list[str]:
    """Where the datasets were measured, each machine, day and commit once."""
    found = []
    for data in given:
        about = json.loads(data.attrs["machine"])
        told = f"{about['processor']}, {about['cores']} cores, {about['date'][:10]}"
        found.append(f"{told}, commit {about['commit'][:10]}")
    return list(dict.fromkeys(found))
