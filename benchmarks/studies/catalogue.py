"""The suites of `snakemake benchmark`, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import xarray as xr

from benchmarks.harness import (
    MeasuringLimits,
    SettingLadder,
    Tell,
    Worker,
    WorkPrecisionPoint,
    climb,
    dataset,
)
from benchmarks.methods import selection
from benchmarks.scenes import load_cases
from benchmarks.studies import ablation, optimiser_contest, sweep_growth
from benchmarks.suites import static
from benchmarks.tracking import frame_rates
from pipeline.datasets.tables import Kind
from pipeline.runtime import UserError

PRECISION = "precision_"
DESIGNED = ("fig2", "fig4", "fig5", "small_push")
"""Scenes that optimisers are compared on."""
FEW = optimiser_contest.OptimiserBudget(8, 20.0)
"""Of a small scene."""


@dataclass(frozen=True)
class Suite:
    """What is measured together.

    Attributes:
        subject: what one run computes.
        reference: what errors are measured against.
        measure: gives the dataset, without its attributes.
        kind: of the dataset.
    """

    subject: str
    reference: str
    measure: Callable[[MeasuringLimits, Tell], xr.Dataset]
    kind: Kind = "benchmark"


def named(name: str, videos: Path) -> Suite:
    """The suite of that name; tracking has its own folder of videos.

    Raises:
        UserError: there is none.
    """
    suites: dict[str, Callable[[], Suite]] = {
        **{f"{PRECISION}{scene}": partial(_precision, scene) for scene in load_cases.TITLES},
        **{f"optimisers_{scene}": partial(_contest, scene) for scene in DESIGNED},
        "tracking": partial(_tracking, videos),
        "ablation": partial(_ablation, "fig2", "fig4"),
        "small_ablation": partial(_ablation, "small_wave", "small_push"),
        "growth": partial(_growth, static.SIDES),
        "small_growth": partial(_growth, static.SIDES[:2]),
        "cases": partial(_cases, sweep_growth.COUNTS, None),
        "small_cases": partial(_cases, sweep_growth.COUNTS[:2], "quick"),
    }
    if name not in suites:
        raise UserError(
            "no such suite", key="suite", value=name, remedy=f"one of: {', '.join(suites)}"
        )
    return suites[name]()


def _precision(scene: str) -> Suite:
    return Suite(
        load_cases.TITLES[scene], selection.reference_in_words(scene), partial(_climbed, scene)
    )


def _climbed(scene: str, rules: MeasuringLimits, tell: Tell) -> xr.Dataset:
    tell(f"{scene}: reference")
    with Worker(selection.reference(scene)) as worker:
        worker.prepare()
        reference = worker.run().sample.values
    units = load_cases.scene(scene).lattice.n_units
    found: list[WorkPrecisionPoint] = []
    for ladder in selection.ladders(scene):
        found += climb(ladder, reference, rules, units, tell)
    return dataset(found)


def _contest(scene: str) -> Suite:
    terms = FEW if scene.startswith("small") else optimiser_contest.OptimiserBudget()
    told = f"{terms.evaluations} evaluations or {terms.seconds:g} s"
    return Suite(
        f"Optimisers on the design of {load_cases.TITLES[scene]}",
        f"nothing: losses are evaluated afresh; each optimiser gets {told}",
        lambda _, tell: optimiser_contest.measure(scene, terms, tell),
        "contest",
    )


def _tracking(videos: Path) -> Suite:
    return Suite(
        "Tracking: error against frame rate",
        "the known motion of rendered (SYNTHETIC) videos",
        lambda _, tell: frame_rates.measure(videos, tell),
        "tracking",
    )


def _ablation(wave: str, push: str) -> Suite:
    return Suite(
        f"What is skipped: in time {load_cases.TITLES[wave]}; at rest {load_cases.TITLES[push]}",
        "the result with the skip made: the change is that of not skipping",
        lambda rules, tell: dataset(ablation.measure(wave, push, rules, tell)),
    )


def _growth(sides: tuple[int, ...]) -> Suite:
    return Suite(
        "Growth with the lattice: an equilibrium at 10 % compression from rest",
        "two loads on the way, each to a hundredth of the usual residual",
        partial(_grown, sides),
    )


def _cases(counts: tuple[int, ...], preset: str | None) -> Suite:
    return Suite(
        "Growth with the number of cases: a sweep of Figure 2's scene, two structures in each",
        "the first case alone",
        partial(sweep_growth.measure, counts, preset),
    )


def _grown(sides: tuple[int, ...], rules: MeasuringLimits, tell: Tell) -> xr.Dataset:
    with Worker(partial(static.strict, sides)) as worker:
        worker.prepare()
        reference = worker.run().sample.values
    found: list[WorkPrecisionPoint] = []
    for way, largest in static.WAYS.items():
        rungs = tuple((f"{side} × {side}", side) for side in sides if side <= largest)
        for rung in rungs:
            ladder = SettingLadder(way, partial(static.grown, way), (rung,), True, ("loss",), 3)
            found += climb(ladder, reference, rules, rung[1] ** 2, tell)
    return dataset(found)
