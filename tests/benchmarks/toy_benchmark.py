"""Defines a toy suite: the integral of exp over [0, 1] and its derivative by a stretch."""

import os
import time
from functools import partial

import numpy as np

from benchmarks import harness


def exact() -> harness.Run:
    values = {"loss": np.asarray(np.e - 1), "gradient@stretch": np.ones(1), "loss@half": np.ones(1)}
    return lambda: harness.Sample(values, {})


def trapezoids(n: float, task: str = "") -> harness.Run:
    del task
    x = np.linspace(0.0, 1.0, int(n))

    def run() -> harness.Sample:
        loss, gradient = np.trapezoid(np.exp(x), x), np.trapezoid(x * np.exp(x), x)
        values = {"loss": np.asarray(loss), "gradient@stretch": np.array([gradient])}
        return harness.Sample(values, {"evaluations": int(n)})

    return run


def slow_at_setting(setting: float, task: str) -> harness.Run:
    """Makes a run that is busy for ten seconds unless the setting is zero."""
    del task

    def run() -> harness.Sample:
        end = time.process_time() + (10.0 if setting else 0.0)
        while time.process_time() < end:
            pass
        return exact()()

    return run


def fails_at_first(n: float, task: str) -> harness.Run:
    if n == 0.0:
        raise ArithmeticError("too loose")
    return trapezoids(n, task)


def raises_when_run() -> harness.Run:
    def run() -> harness.Sample:
        raise ValueError("no such integral")

    return run


def raises_when_prepared() -> harness.Run:
    raise ImportError("no such method")


def dies() -> harness.Run:
    return lambda: os._exit(3)


def suite(*more: harness.Method) -> harness.Suite:
    fine = {"repeats": 1, "share": 0.25, "baseline": True, "note": "scaled"}
    return harness.in_turn(
        "toy",
        "integral of exp",
        ("the exact one", exact),
        (
            harness.Method("coarse", partial(trapezoids, 11)),
            harness.Method("fine", partial(trapezoids, 1001), **fine),  # type: ignore[arg-type]
            *more,
        ),
        (
            harness.Target("loss error", harness.error_of("coarse", "loss"), at_most=1e-3),
            harness.Target(
                "fine loss error", harness.error_of("fine", "loss"), at_most=1e-9, aim=1e-12
            ),
            harness.Target("time", harness.seconds_of("coarse"), "s", at_least=0.0),
            harness.Target("speed", harness.time_ratio("absent", "coarse"), at_least=2),
        ),
        units=4,
    )
