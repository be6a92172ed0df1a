"""Makes the page on benchmarks: a section for each picture, with what lies behind it."""

import argparse
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import xarray as xr
from matplotlib.figure import Figure

from pipeline import datasets
from reports.base import Table, prose
from reports.page import Report, publish
from reports.products.benchmark import charts, optimisers, tables, work_precision

PRECISION, OPTIMISERS, TRACKING = "precision_", "optimisers_", "tracking"
_PROSE = prose(__file__)


class BenchmarkSection(NamedTuple):
    """Holds a picture of the page."""

    name: str  # of its files
    title: str
    caption: str
    draw: Callable[[], Figure]  # makes it
    shown: Mapping[str, xr.Dataset]  # the datasets that it shows, by the names of their files


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    publish(benchmark_report({path.stem: _read(path) for path in args.datasets}), args.out_dir)


def benchmark_report(given: Mapping[str, xr.Dataset]) -> Report:
    """Returns the report of datasets, by the names of their files."""
    shown = list(sections(given))
    known: set[str] = set()
    values, written = [], []
    for section in shown:
        fresh = {name: data for name, data in section.shown.items() if name not in known}
        known.update(fresh)
        own = [tables.table(name, data) for name, data in fresh.items()]
        values.append(_values(section, fresh, own))
        written += own
    figures = {section.name: section.draw for section in shown}
    page = {"sections": values, "machines": _machines(given.values())}
    return Report(figures, "benchmark.html.j2", page, written)


def _read(path: Path) -> xr.Dataset:
    if path.stem.startswith(OPTIMISERS):
        return datasets.read(path, "contest")
    return datasets.read(path, "tracking" if path.stem == TRACKING else "benchmark")


def _values(
    section: BenchmarkSection, fresh: Mapping[str, xr.Dataset], own: Sequence[Table]
) -> dict[str, object]:
    """Tells what the page tells of a section; tables that an earlier one has shown are left out."""
    return {
        "picture": section,
        "files": [*(table.name for table in own), *(f"{name}.nc" for name in section.shown)],
        "references": list(dict.fromkeys(data.attrs["reference"] for data in fresh.values())),
        "points": {table.name: (list(table.columns), list(tables.rows(table))) for table in own},
        "failed": [one for data in fresh.values() for one in tables.failures(data)],
        "provenance": {name: sorted(data.attrs.items()) for name, data in fresh.items()},
    }


def _machines(given: Iterable[xr.Dataset]) -> list[str]:
    """Tells where the datasets were measured, each machine, day and commit once."""
    found = []
    for data in given:
        about = json.loads(data.attrs["machine"])
        told = f"{about['processor']}, {about['cores']} cores, {about['date'][:10]}"
        found.append(f"{told}, commit {about['commit'][:10]}")
    return list(dict.fromkeys(found))


def sections(given: Mapping[str, xr.Dataset]) -> Iterator[BenchmarkSection]:
    """Yields the pictures of the datasets given, in the order of the page."""
    scenes, contests = _of(given, PRECISION), _of(given, OPTIMISERS)
    for name, data in scenes.items():
        shown = {f"{PRECISION}{name}": data}
        draw = partial(work_precision.draw_work_precision, data)
        told = data.attrs["subject"]
        yield BenchmarkSection(f"{PRECISION}{name}", told, _PROSE["precision"], draw, shown)
    for name, title, start, found, several in (
        ("gradients", "Cost of a gradient", PRECISION, scenes, work_precision.draw_gradients),
        ("optimisers", "Optimisers", OPTIMISERS, contests, optimisers.draw_optimisers),
    ):
        if found:
            shown = {f"{start}{scene}": data for scene, data in found.items()}
            yield BenchmarkSection(name, title, _PROSE[name], partial(several, found), shown)
    for name, single in (
        ("growth", charts.draw_growth),
        ("cases", charts.draw_growth),
        ("ablation", charts.draw_ablation),
        (TRACKING, charts.draw_tracking_accuracy),
    ):
        for stem in (name, f"small_{name}"):
            if stem in given:
                data = given[stem]
                draw, told = partial(single, data), data.attrs["subject"]
                yield BenchmarkSection(stem, told, _PROSE[name], draw, {stem: data})


def _of(given: Mapping[str, xr.Dataset], start: str) -> dict[str, xr.Dataset]:
    """Returns the datasets whose names begin so, by what follows."""
    return {
        name.removeprefix(start): data for name, data in given.items() if name.startswith(start)
    }
