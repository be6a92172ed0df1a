"""States numbers of several designs: how well each shields the boundary, and how that goes on."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from pipeline.posing import loss_units
from reports.facts import Fact, checks, facts_of, grouped
from reports.figures.several_designs.designs import DesignSeries, SeriesDesign
from reports.study import evaluation_count, from_dataset

_told = facts_of(__file__)


def design_series_facts(family: DesignSeries) -> list[Fact]:
    """Returns all facts: the setting, the trend, and each design."""
    return [
        *grouped("Setting", _setting(family)),
        *grouped("Trend", _trend(family)),
        *(
            fact
            for design in family.designs
            for fact in grouped(f"Cloaked, {family.label(design)}", _design(design))
        ),
    ]


def _setting(family: DesignSeries) -> Iterator[Fact]:
    design = family.designs[0]
    scene = design.scene
    yield _told("units", scene.columns * scene.rows, f"{scene.columns} × {scene.rows}")
    yield _told("spacing", scene.spacing)
    yield checks.bias_fact(from_dataset(design.study.design, scene.spacing, "vertices_initial"))
    yield _told("amplitude", scene.amplitude)
    yield _told("frequency", scene.frequency)
    angles = ", ".join(f"{angle:g}" for angle in scene.directions)
    yield _told("directions", len(scene.directions), f"{angles}°")


def _trend(family: DesignSeries) -> Iterator[Fact]:
    peaks = np.array([_boundary(design, "cloaked") for design in family.designs])
    gains = -np.diff(peaks)
    yield _told("boundary_rises", int((gains < 0).sum()))
    yield _told("boundary_growing_returns", int((np.diff(gains) > 0).sum()))
    altered = _boundary(family.designs[0], "altered")
    yield _told("boundary_altered", altered)
    best = family.label(family.designs[int(peaks.argmin())])
    yield _told("boundary_reduction", 1.0 - float(peaks.min()) / altered, best=best)


def _boundary(design: SeriesDesign, structure: str) -> float:
    return float(design.boundary.sel(structure=structure))


def _design(design: SeriesDesign) -> Iterator[Fact]:
    told = partial(_told, number=design.number)
    cloaked, altered = _boundary(design, "cloaked"), _boundary(design, "altered")
    yield told("design_{number}.cloak", design.units)
    if design.study.problem.cloak.bounds is not None:
        yield told("design_{number}.radius", design.study.problem.cloak.bounds[2])
    yield told("design_{number}.boundary", cloaked)
    yield told("design_{number}.boundary_reduction", 1.0 - cloaked / altered)
    unit = loss_units(design.study.problem)
    yield told("design_{number}.loss", design.loss("cloaked"), unit=unit)
    yield told("design_{number}.loss_altered", design.loss("altered"), unit=unit)
    found = design.study.design
    yield told("design_{number}.evaluations", evaluation_count(found))
    for fact in checks.design_facts(found):
        yield replace(fact, key=f"design_{design.number}.{fact.key}")
    moving = float(design.study.response["min_gap"].sel(structure="cloaked").min())
    yield told("design_{number}.gap_motion", moving)
