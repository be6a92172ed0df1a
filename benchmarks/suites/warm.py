"""Measures Figure 4's whole path, loss and gradient, along a walk of designs."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.harness import (
    Method,
    Run,
    Sample,
    Suite,
    Target,
    error_of,
    in_turn,
    seconds_of,
    time_ratio,
)
from benchmarks.scenes import paper_scenes
from sim.core import Floats
from sim.quasistatics import StaticRecord, StaticSolver
from sim.scene import Evaluator, Scene, make_plan

COLD, WARM = "from rest", "from the last design"
STEPS, DESIGNS = 10, 10
STEP = 0.1
"""Largest change of a vertex from one design to the next, mm; optimisers move less near the end."""


def suite() -> Suite:
    """Makes the suite."""
    method = partial(Method, share=float(DESIGNS))
    return in_turn(
        "warm",
        "loss and gradient over 10 load steps of Figure 4, mean of a walk of 10 designs",
        ("paths from rest to a thousandth of the usual residual", partial(_walk, 1e-13, False)),
        (method(COLD, partial(_walk, 1e-10, False)), method(WARM, partial(_walk, 1e-10, True))),
        (
            Target("whole path", seconds_of(COLD), "s", at_most=0.15),
            Target(f"time {WARM} over time {COLD}", time_ratio(WARM, COLD), at_most=1.0),
            Target("loss error", error_of(WARM, "loss"), at_most=1e-9),
            Target("gradient error", error_of(WARM, "gradient"), at_most=1e-7),
        ),
        225,
    )


class WarmStart:
    """Offers the last design's path or none, and counts the work of all."""

    def __init__(self, warm: bool) -> None:
        self.warm = warm
        self.total: Counter[str] = Counter()
        self._records: Sequence[StaticRecord] | None = None

    def start(self) -> Sequence[StaticRecord] | None:
        """Returns the last design's path."""
        return self._records if self.warm else None

    def keep(self, design: Floats, records: Sequence[StaticRecord]) -> None:
        """Stores a path."""
        del design
        self._records = records
        for record in records:
            self.total.update(paper_scenes.work_of(record))

    def forget(self) -> None:
        """Begins anew."""
        self._records = None
        self.total.clear()


def _walk(relative: float, warm: bool) -> Run:
    return walk(paper_scenes.fig4().updated(steps=STEPS), relative, warm)


def walk(scene: Scene, relative: float, warm: bool) -> Run:
    """Prepares losses and gradients along a random walk of designs."""
    plan = make_plan(scene)
    assert isinstance(plan.solver, StaticSolver)
    memory = WarmStart(warm)
    strict = replace(plan, solver=replace(plan.solver, relative=relative))
    evaluate = Evaluator(scene, strict, memory)
    rng = np.random.default_rng(0)
    walk = np.cumsum(rng.uniform(-STEP, STEP, (DESIGNS, scene.space.n_variables)), axis=0)

    def run() -> Sample:
        memory.forget()
        values = {}
        for number, design in enumerate(walk):
            loss, gradient, _ = evaluate(design)
            values[f"loss@{number}"] = np.asarray(loss)
            values[f"gradient@{number}"] = gradient
        return Sample(values, dict(memory.total))

    run()
    return run
