"""Makes the page on benchmarks: a section for each picture, with what lies behind it."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import xarray as xr
from matplotlib.figure import Figure

from pipeline import datasets
from reports.base import Table
from reports.page import Report, publish
from reports.products.benchmark import charts, optimisers, tables, work_precision

PRECISION, OPTIMISERS, TRACKING = "precision_", "optimisers_", "tracking"
_PRECISION = (
    "Processor time of one run against the error of (a) the motion of the region of interest, (b)"
    " the loss, (c) its gradient by all design variables, each method at ever tighter settings."
    " Points are medians, bars the range of the runs. Compile time is not in it: see the table."
)
_GRADIENTS = (
    "What a gradient costs beside its loss, by the adjoints of the solvers and by central"
    " differences, against its error. Differences take two losses for every design variable."
)
_GROWTH = (
    "(a) Time of one equilibrium, from rest to 10 % compression; the exponents are fitted to"
    " lattices of 900 units and more. (b) Peak memory of the process, of which Python, JAX and the"
    " compiler take most."
)
_CASES = (
    "(a) Time of a sweep, of which each case is a problem of its own, read, checked and simulated;"
    " (b) peak memory of its process. The exponents are fitted to 10 cases and more."
)
_ABLATION = (
    "What a plan can skip, done (grey) and skipped (purple); how many times longer it takes to do"
    " it, and the largest change of the result that it makes."
)
_OPTIMISERS = (
    "Loss of the best design so far that keeps all limits (to 1 µm), against evaluations and"
    " processor time, and its KKT residual. Below: the share of problems (each scene, with 30, 10"
    " and 3 % of the possible decrease left) that an optimiser solves within so many times the"
    " evaluations of the fastest."
)
_TRACKING = (
    "Root mean square error of the displacement (left) and the rotation (right) of the units"
    " against the rate of the frames that are kept; the videos are rendered (SYNTHETIC)."
)


class BenchmarkSection(NamedTuple):
    """Holds a picture of the page.

    Attributes:
        name: of its files.
        title, caption: what it shows.
        draw: makes it.
        shown: the datasets that it shows, by the names of their files.
    """

    name: str
    title: str
    caption: str
    draw: Callable[[], Figure]
    shown: Mapping[str, xr.Dataset]


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
        "provenance": {name: _attributes(data) for name, data in fresh.items()},
    }


def _attributes(data: xr.Dataset) -> list[tuple[str, str]]:
    return sorted((str(key), str(value)) for key, value in data.attrs.items())


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
    scenes = _of(given, PRECISION)
    for name, data in scenes.items():
        draw = partial(work_precision.draw_work_precision, data)
        told = data.attrs["subject"]
        yield BenchmarkSection(
            f"{PRECISION}{name}", told, _PRECISION, draw, {f"{PRECISION}{name}": data}
        )
    if scenes:
        draw = partial(work_precision.draw_gradients, scenes)
        shown = {f"{PRECISION}{name}": data for name, data in scenes.items()}
        yield BenchmarkSection("gradients", "Cost of a gradient", _GRADIENTS, draw, shown)
    contests = _of(given, OPTIMISERS)
    if contests:
        draw = partial(optimisers.draw_optimisers, contests)
        shown = {f"{OPTIMISERS}{name}": data for name, data in contests.items()}
        yield BenchmarkSection("optimisers", "Optimisers", _OPTIMISERS, draw, shown)
    for name, caption, build in (
        ("growth", _GROWTH, charts.draw_growth),
        ("cases", _CASES, charts.draw_growth),
        ("ablation", _ABLATION, charts.draw_ablation),
        (TRACKING, _TRACKING, charts.draw_tracking_accuracy),
    ):
        for stem in (name, f"small_{name}"):
            if stem in given:
                data = given[stem]
                draw = partial(build, data)
                yield BenchmarkSection(stem, data.attrs["subject"], caption, draw, {stem: data})


def _of(given: Mapping[str, xr.Dataset], start: str) -> dict[str, xr.Dataset]:
    """Returns the datasets whose names begin so, by what follows."""
    return {
        name.removeprefix(start): data for name, data in given.items() if name.startswith(start)
    }
