"""The pictures of the page on benchmarks, by the datasets that there are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import NamedTuple

import xarray as xr
from matplotlib.figure import Figure

from reports.products.benchmark import (
    ablation,
    gradients,
    growth,
    optimisers,
    tracking_accuracy,
    work_precision,
)

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


class BenchmarkPicture(NamedTuple):
    """A picture of the page.

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


def pictures(given: Mapping[str, xr.Dataset]) -> Iterator[BenchmarkPicture]:
    """Pictures of the datasets given, in the order of the page."""
    scenes = _of(given, PRECISION)
    for name, data in scenes.items():
        draw = partial(work_precision.draw_work_precision, data)
        told = data.attrs["subject"]
        yield BenchmarkPicture(
            f"{PRECISION}{name}", told, _PRECISION, draw, {f"{PRECISION}{name}": data}
        )
    if scenes:
        draw = partial(gradients.draw_gradients, scenes)
        shown = {f"{PRECISION}{name}": data for name, data in scenes.items()}
        yield BenchmarkPicture("gradients", "Cost of a gradient", _GRADIENTS, draw, shown)
    contests = _of(given, OPTIMISERS)
    if contests:
        draw = partial(optimisers.draw_optimisers, contests)
        shown = {f"{OPTIMISERS}{name}": data for name, data in contests.items()}
        yield BenchmarkPicture("optimisers", "Optimisers", _OPTIMISERS, draw, shown)
    for name, caption, build in (
        ("growth", _GROWTH, growth.draw_growth),
        ("cases", _CASES, growth.draw_growth),
        ("ablation", _ABLATION, ablation.draw_ablation),
        (TRACKING, _TRACKING, tracking_accuracy.draw_tracking_accuracy),
    ):
        for stem in (name, f"small_{name}"):
            if stem in given:
                data = given[stem]
                draw = partial(build, data)
                yield BenchmarkPicture(stem, data.attrs["subject"], caption, draw, {stem: data})


def _of(given: Mapping[str, xr.Dataset], start: str) -> dict[str, xr.Dataset]:
    """The datasets whose names begin so, by what follows."""
    return {
        name.removeprefix(start): data for name, data in given.items() if name.startswith(start)
    }
