"""Lists the suites, by name: those that run in turn, and those of `snakemake benchmark`."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from benchmarks.harness import (
    Measurement,
    MeasuringLimits,
    Suite,
    Tell,
    measure_settings,
    result_of,
)
from benchmarks.methods import selection
from benchmarks.scenes import load_cases
from benchmarks.suites import (
    ablation,
    accuracy,
    fig2,
    fig4,
    optimiser_contest,
    precision,
    static,
    sweep_growth,
    warm,
)
from benchmarks.tracking import frame_rates
from pipeline.runtime import UserError

VIDEOS = Path("tests/data/tracking")
DESIGNED = ("fig2", "fig4", "fig5", "small_push")
"""Scenes that optimisers are compared on."""
SMALL_BUDGET = optimiser_contest.OptimiserBudget(8, 20.0)
"""Of a small scene."""
IN_TURN: dict[str, Callable[[], Suite]] = {
    module.__name__.rpartition(".")[2]: module.suite
    for module in (fig2, fig4, precision, static, warm)
}


def suites(names: Sequence[str], videos: Path = VIDEOS) -> list[Suite]:
    """Makes the suites of these names, the short ones without; tracking has a folder of videos.

    Raises:
        UserError: there is none of a name.
    """
    makers = _suite_makers(videos)
    for name in names:
        if name not in makers:
            remedy = f"one of: {', '.join(makers)}"
            raise UserError("no such suite", key="suite", value=name, remedy=remedy)
    made = [makers[name](name) for name in names or IN_TURN]
    return [suite for suite in made if names or suite.short]


def _suite_makers(videos: Path) -> dict[str, Callable[[str], Suite]]:
    return {
        **{name: lambda _, make=make: make() for name, make in IN_TURN.items()},  # type: ignore[misc]
        **{f"precision_{scene}": partial(_precision, scene) for scene in load_cases.TITLES},
        **{f"optimisers_{scene}": partial(_contest, scene) for scene in DESIGNED},
        "accuracy": _accuracy,
        "tracking": partial(_tracking, videos),
        "ablation": partial(_ablation, "fig2", "fig4"),
        "small_ablation": partial(_ablation, "small_wave", "small_push"),
        "growth": partial(_growth, static.SIDES),
        "small_growth": partial(_growth, static.SIDES[:2]),
        "cases": partial(_cases, sweep_growth.COUNTS, None),
        "small_cases": partial(_cases, sweep_growth.COUNTS[:2], "quick"),
    }


def _precision(scene: str, name: str) -> Suite:
    told = selection.reference_described(scene)
    return Suite(name, load_cases.TITLES[scene], told, partial(_all_methods, scene))


def _all_methods(scene: str, limits: MeasuringLimits, tell: Tell) -> list[Measurement]:
    tell("reference")
    reference = result_of(selection.reference(scene))
    units, measured = load_cases.scene(scene).lattice.n_units, list[Measurement]()
    for method in selection.methods(scene):
        measured += measure_settings(method, reference, units, limits, tell)
    return measured


def _contest(scene: str, name: str) -> Suite:
    budget = SMALL_BUDGET if scene.startswith("small") else optimiser_contest.OptimiserBudget()
    told = f"{budget.evaluations} evaluations or {budget.seconds:g} s"
    return Suite(
        name,
        f"Optimisers on the design of {load_cases.TITLES[scene]}",
        f"nothing: losses are evaluated afresh; each optimiser gets {told}",
        partial(optimiser_contest.measure, scene, budget),
        "contest",
    )


def _tracking(videos: Path, name: str) -> Suite:
    return Suite(
        name,
        "Tracking: error against frame rate",
        "the known motion of rendered (SYNTHETIC) videos",
        partial(frame_rates.measure, videos),
        "tracking",
    )


def _accuracy(name: str) -> Suite:
    subject = "Errors of loss and motion under all kinds of drives, true and stated"
    return Suite(name, subject, accuracy.REFERENCE, accuracy.measure)


def _ablation(wave: str, push: str, name: str) -> Suite:
    return Suite(
        name,
        f"What is skipped: in time {load_cases.TITLES[wave]}; at rest {load_cases.TITLES[push]}",
        "the result with the skip made: the change is that of not skipping",
        partial(ablation.measure, wave, push),
    )


def _growth(sides: tuple[int, ...], name: str) -> Suite:
    subject = "Growth with the lattice: an equilibrium at 10 % compression from rest"
    return Suite(name, subject, static.REFERENCE, partial(static.growth, sides))


def _cases(counts: tuple[int, ...], preset: str | None, name: str) -> Suite:
    return Suite(
        name,
        "Growth with the number of cases: a sweep of Figure 2's scene, two structures in each",
        "the first case alone",
        partial(sweep_growth.measure, counts, preset),
    )
