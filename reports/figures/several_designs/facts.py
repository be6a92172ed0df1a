"""States numbers of several designs: how well each shields the boundary, and how that goes on."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from reports.facts import Fact, checks, grouped, number, share
from reports.figures.several_designs.designs import DesignSeries, SeriesDesign
from reports.study import from_dataset


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
    size = f"{scene.columns} × {scene.rows}"
    yield Fact("units", "Units", scene.columns * scene.rows, "1", size)
    yield number("spacing", "Spacing", scene.spacing, "mm")
    initial = from_dataset(design.study.design, scene.spacing, "vertices_initial")
    yield checks.bias_fact(initial)
    yield number("amplitude", "Amplitude of the source", scene.amplitude, "mm")
    yield number("frequency", "Frequency of the source", scene.frequency, "Hz")
    angles = ", ".join(f"{angle:g}" for angle in scene.directions)
    yield Fact("directions", "Load angles", len(scene.directions), "1", f"{angles}°")


def _trend(family: DesignSeries) -> Iterator[Fact]:
    peaks = np.array([_boundary(design, "cloaked") for design in family.designs])
    gains = -np.diff(peaks)
    note = "largest |U| on the boundary, mean over the load angles"
    rises, more = int((gains < 0).sum()), int((np.diff(gains) > 0).sum())
    yield number("boundary_rises", "Larger cloaks that move the boundary more", rises, note=note)
    yield number("boundary_growing_returns", "Larger cloaks that gain more than the step before",
                 more, note=note)  # fmt: skip
    altered = _boundary(family.designs[0], "altered")
    yield number("boundary_altered", "Largest |U| on the boundary, altered", altered, digits=3)
    best = family.designs[int(peaks.argmin())]
    least = 1.0 - float(peaks.min()) / altered
    note = f"cloaked, {family.label(best)}"
    yield share("boundary_reduction", "Largest |U| on the boundary reduced by", least, note=note)


def _boundary(design: SeriesDesign, structure: str) -> float:
    return float(design.boundary.sel(structure=structure))


def _design(design: SeriesDesign) -> Iterator[Fact]:
    key = f"design_{design.number}"
    cloaked, altered = _boundary(design, "cloaked"), _boundary(design, "altered")
    yield number(f"{key}.cloak", "Units in the cloak", design.units)
    if design.study.problem.cloak.bounds is not None:
        radius = design.study.problem.cloak.bounds[2]
        yield number(f"{key}.radius", "Radius of the cloak", radius, "mm")
    yield number(f"{key}.boundary", "Largest |U| on the boundary", cloaked, digits=3)
    yield share(f"{key}.boundary_reduction", "Reduced by", 1.0 - cloaked / altered,
                note="against the altered structure")  # fmt: skip
    yield number(f"{key}.loss", "Loss J", design.loss("cloaked"), digits=3)
    yield number(f"{key}.loss_altered", "Loss J of the altered structure", design.loss("altered"),
                 digits=3, note="depends on the size of the region of interest")  # fmt: skip
    found = design.study.design
    yield number(f"{key}.evaluations", "Evaluations", _evaluations(found))
    for fact in checks.design_facts(found):
        yield Fact(
            f"{key}.{fact.key}", fact.label, fact.value, fact.unit, fact.ours, note=fact.note
        )
    moving = float(design.study.response["min_gap"].sel(structure="cloaked").min())
    yield number(f"{key}.gap_motion", "Smallest gap in motion", moving, "mm", digits=3)


def _evaluations(design: xr.Dataset) -> int:
    return int(np.isfinite(design["loss"]).sum())
