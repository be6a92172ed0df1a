"""A toy scene: the integral of exp over [0, 1] and its derivative by a stretch of the exponent."""

from __future__ import annotations

import os
import time
from functools import partial

import numpy as np

from benchmarks.harness import (
    Benchmark,
    Candidate,
    Run,
    Sample,
    Target,
    error_of,
    seconds_of,
    speed_up,
)


def exact() -> Run:
    values = {"loss": np.asarray(np.e - 1), "gradient@stretch": np.ones(1), "loss@half": np.ones(1)}
    return lambda: Sample(values, {})


def trapezoids(n: int) -> Run:
    def run() -> Sample:
        x = np.linspace(0.0, 1.0, n)
        loss, gradient = np.trapezoid(np.exp(x), x), np.trapezoid(x * np.exp(x), x)
        values = {"loss": np.asarray(loss), "gradient@stretch": np.array([gradient])}
        return Sample(values, {"evaluations": n})

    return run


def at_setting(n: float, task: str) -> Run:
    del task
    return trapezoids(int(n))


def slow_at_setting(setting: float, task: str) -> Run:
    """Busy for ten seconds unless the setting is zero."""
    del task

    def run() -> Sample:
        end = time.process_time() + (10.0 if setting else 0.0)
        while time.process_time() < end:
            pass
        return exact()()

    return run


def fails_at_first(n: float, task: str) -> Run:
    if n == 0.0:
        raise ArithmeticError("too loose")
    return at_setting(n, task)


def raises_when_run() -> Run:
    def run() -> Sample:
        raise ValueError("no such integral")

    return run


def raises_when_prepared() -> Run:
    raise ImportError("no such method")


def dies() -> Run:
    def run() -> Sample:
        os._exit(3)

    return run


def benchmark(*more: Candidate) -> Benchmark:
    return Benchmark(
        name="toy",
        title="integral of exp",
        reference=exact,
        candidates=(
            Candidate("coarse", partial(trapezoids, 11)),
            Candidate(
                "fine",
                partial(trapezoids, 1001),
                repeats=1,
                share=0.25,
                baseline=True,
                note="scaled",
            ),
            *more,
        ),
        targets=(
            Target("loss error", error_of("coarse", "loss"), at_most=1e-3),
            Target("fine loss error", error_of("fine", "loss"), at_most=1e-9, aim=1e-12),
            Target("time", seconds_of("coarse"), "s", at_least=0.0),
            Target("speed", speed_up("coarse", "absent"), at_least=2),
        ),
    )
