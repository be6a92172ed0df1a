"""The contact barrier from both sides: starts beyond it, steps too large, loads pressing on it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.stress import (
    LAWS,
    Check,
    StressCase,
    StressFamily,
    StressScene,
    equilibria,
    motions,
    posed,
    pressed,
    shaken,
    squares,
)
from sim.solvers import Harmonic, TimeSeries
from sim.time_integration import ExplicitSolver, ImplicitSolver

HARD = Harmonic(8.0, 30.0, 0.6)
CHAOS = 0.1
"""What half the steps may change where units collide again and again."""


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "barrier",
        "starts on and beyond the contact barrier, explicit steps too large, compression to 25 %,"
        " 8 mm at 30 Hz, both laws of contact",
        "balance by the definition, void angles and overlaps by geometry, half the steps",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
    side = 5 if small else 9
    yield from _starts((-14.99, -16.0) if small else (-14.99, -15.0, -16.0, -40.0))
    for share in (0.25,) if small else (0.05, 0.1, 0.15, 0.2, 0.25):
        for law, contact in LAWS.items():
            for n_loads in (1,) if small else (1, 10):
                case = pressed(squares(side), share, contact=contact)
                loads = np.arange(1, n_loads + 1) / n_loads
                name = f"pressed by {share:.0%} in {n_loads} loads, contact on {law}"
                yield StressCase(name, partial(equilibria, case, loads))
    for law, contact in LAWS.items():
        case = shaken(squares(side), HARD, duration=0.05, frequency=30.0, contact=contact)
        yield StressCase(f"8 mm at 30 Hz, contact on {law}", partial(_shaken, case))
    case = shaken(squares(5), HARD, duration=0.02, frequency=30.0)
    for n_steps in (1,) if small else (1, 10, 100):
        yield StressCase(f"{n_steps} explicit steps asked for", partial(_too_large, case, n_steps))


def _starts(angles: Sequence[float]) -> Iterator[StressCase]:
    for angle in angles:
        lattice = squares(5, bias=45.0 - angle / 2)
        beyond = angle <= -15.0
        for share in (0.02, -0.05):
            name = f"voids of {angle:g} deg at rest, {'pressed' if share > 0 else 'pulled'}"
            attempt = partial(equilibria, pressed(lattice, share), np.array([0.0, 0.5, 1.0]))
            yield StressCase(name, attempt, "refusal" if beyond else "solution")
        gentle = shaken(lattice, Harmonic(0.2, 30.0), duration=0.01, frequency=30.0)
        for integrator in ("implicit", "explicit"):
            case = replace(gentle, scene=gentle.scene.updated(integrator=integrator))
            name = f"voids of {angle:g} deg at rest, shaken, {integrator}"
            yield StressCase(name, partial(_shaken, case), "refusal" if beyond else "either")
    yield from _jolts()


def _jolts() -> Iterator[StressCase]:
    """Held units that are beyond the barrier from the first moment, or get there."""
    for start, sense in ((-2.0, "further"), (-2.0, "back")):
        end = -3.0 if sense == "further" else 0.0
        series = TimeSeries(np.array([0.0, 0.01]), np.array([[0, 0, start], [0, 0, end]]))
        case = posed(squares(3), [0], [4], series, duration=0.01)
        times = np.linspace(0.0, 0.01, 11)
        implicit = ImplicitSolver(case.topology, times, times)
        explicit = ExplicitSolver(case.topology, 0.01, 100, times)
        for name, solver in (("implicit", implicit), ("explicit", explicit)):
            said = f"turned beyond the barrier at once, then {sense}, {name}"
            attempt = partial(motions, case, times, CHAOS, solver)
            yield StressCase(said, attempt, "refusal")


def _shaken(case: StressScene) -> Sequence[Check]:
    return motions(case, np.linspace(0.0, case.scene.loads.duration, 101), CHAOS)


def _too_large(case: StressScene, n_steps: int) -> Sequence[Check]:
    asked = np.array([case.scene.loads.duration])
    solver = ExplicitSolver(case.topology, case.scene.loads.duration, n_steps, asked)
    return motions(case, asked, CHAOS, solver)
