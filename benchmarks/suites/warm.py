"""Figure 4's whole path, loss and gradient, along a walk of designs: each start of a solve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from benchmarks.harness import Benchmark, Candidate, Run, Sample, Target, error_of, seconds_of
from benchmarks.scenes import paper_scenes
from sim.core import Floats
from sim.quasistatics import StaticRecord, StaticSolver
from sim.scene import Evaluator, Scene, make_plan

COLD, WARM = "from rest", "from the last design"
STEPS, DESIGNS = 10, 10
STEP = 0.1
"""Largest change of a vertex from one design to the next, mm; optimisers move less near the end."""


def benchmark() -> Benchmark:
    """The benchmark."""
    share = float(DESIGNS)
    return Benchmark(
        name="warm",
        title="loss and gradient over 10 load steps of Figure 4, mean of a walk of 10 designs",
        reference=_strict,
        candidates=(Candidate(COLD, _cold, share=share), Candidate(WARM, _warm, share=share)),
        targets=(
            Target("whole path", seconds_of(COLD), "s", at_most=0.15),
            Target(
                "time from the last design over time from rest",
                lambda found: seconds_of(WARM)(found) / seconds_of(COLD)(found),
                at_most=1.0,
            ),
            Target("loss error", error_of(WARM, "loss"), at_most=1e-9),
            Target("gradient error", error_of(WARM, "gradient"), at_most=1e-7),
        ),
    )


class WarmStart:
    """Offers the last design's path or none, and counts the work of all."""

    def __init__(self, warm: bool) -> None:
        self.warm = warm
        self.total: dict[str, int] = {}
        self._records: Sequence[StaticRecord] | None = None

    def start(self) -> Sequence[StaticRecord] | None:
        """The last design's path."""
        return self._records if self.warm else None

    def keep(self, design: Floats, records: Sequence[StaticRecord]) -> None:
        """Takes a path."""
        del design
        self._records = records
        for record in records:
            for what, count in paper_scenes.work_of(record).items():
                self.total[what] = self.total.get(what, 0) + count

    def forget(self) -> None:
        """Begins anew."""
        self._records = None
        self.total.clear()


def _strict() -> Run:
    return walk(_scene(), 1e-13, warm=False)


def _cold() -> Run:
    return walk(_scene(), 1e-10, warm=False)


def _warm() -> Run:
    return walk(_scene(), 1e-10, warm=True)


def _scene() -> Scene:
    return paper_scenes.fig4().updated(steps=STEPS)


def walk(scene: Scene, relative: float, warm: bool) -> Run:
    """Run of losses and gradients along a random walk of designs."""
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
