"""Measures the growth of a sweep with its cases, each a problem of its own on Figure 2's units."""

from functools import partial
from itertools import islice

import numpy as np
import xarray as xr

from benchmarks.harness import (
    Measurement,
    MeasuringLimits,
    Method,
    Run,
    Sample,
    Tell,
    measure_settings,
    result_of,
)
from pipeline.posing import lattice_of, setting_losses
from pipeline.problem import Problem
from pipeline.problem.reading import load
from pipeline.problem.sections import Sweep, sweep_cases
from pipeline.runtime import ROOT

COUNTS = (1, 10, 100, 400)
PROBLEM = ROOT / "experiments/fig2/problem.yaml"
SWEEP = {
    "random": {
        "drive.directions": {"from": "0 deg", "to": "180 deg"},
        "drive.frequency": {"from": "2 Hz", "to": "16 Hz"},
        "material.bending_stiffness": {"mean": "1.5 N mm/rad", "deviation": "0.15 N mm/rad"},
    },
    "samples": COUNTS[-1],
}
"""One load case each, of the altered structure and of the design, which is unchanged."""


def measure(
    counts: tuple[int, ...], preset: str | None, limits: MeasuringLimits, tell: Tell
) -> list[Measurement]:
    """Measures time and memory of so many cases, each number in a process of its own."""
    units = load(PROBLEM, preset).lattice.n_units
    prepare, measured = partial(cases, preset), list[Measurement]()
    reference = result_of(prepare, 1)
    for count in counts:
        method = Method("sweep", prepare, ((f"{count} cases", float(count)),), True, ("loss",), 1)
        measured += measure_settings(method, reference, units, limits, tell)
    return measured


def cases(preset: str | None, count: float, _: str = "loss") -> Run:
    """Prepares the first ``count`` cases, after one that compiles."""
    asked, wanted = load(PROBLEM, preset), Sweep.model_validate(SWEEP)
    design = _unchanged(asked)
    every = list(islice(sweep_cases.list_settings(wanted), int(count)))
    of_case = partial(
        setting_losses.results, asked, folder=PROBLEM.parent, design=design, threads=1
    )
    of_case(every[0])

    def run() -> Sample:
        losses = [of_case(setting)[0][0].loss for setting in every]
        return Sample({"loss": np.array(losses[:1])}, {"cases": len(losses)})

    return run


def _unchanged(asked: Problem) -> xr.Dataset:
    lattice = lattice_of(asked)
    corners = ("unit", "vertex", "xy"), lattice.padded(lattice.vertices)
    free = ("ligament", "end"), np.full((lattice.n_ligaments, 2), np.nan)
    return xr.Dataset({"vertices": corners, "vertices_initial": corners, "end_angles": free})
