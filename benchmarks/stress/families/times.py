"""Frequencies from 0.1 to 200 Hz, and 1 to a million steps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from benchmarks.stress import (
    Check,
    StressCase,
    StressFamily,
    StressScene,
    admissible,
    balanced,
    motions,
    motions_as_advised,
    pressed,
    reached,
    shaken,
    solved,
    squares,
    stages,
)
from sim.quasistatics import StaticSolver
from sim.solvers import Harmonic, Pulse
from sim.time_integration import ExplicitSolver, ImplicitRecord, ImplicitSolver

DURATION = 0.1
ERROR = {"draft": 0.2, "default": 0.05, "tight": 5e-3}


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "times",
        "drives of 0.1 to 200 Hz and pulses at every accuracy; 1 to 1 000 000 explicit steps, to"
        " 100 000 load steps, to 10 000 implicit steps",
        "balance by the definition at loads and stages, void angles by geometry, half the steps;"
        " tight where the accuracy asked for does not do by its own estimate of error",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
    few = (0.1, 200.0)
    for frequency in few if small else (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 200.0):
        for accuracy in ("default",) if small else ("draft", "default", "tight"):
            if accuracy == "tight" and frequency < 1.0:
                continue  # 170 000 steps a second
            yield _at_frequency(frequency, accuracy)
    for width in (1e-3,) if small else (1e-4, 1e-3, 1e-2):
        pulse = shaken(squares(5), Pulse(1.0, width, 0.4, 4 * width), duration=8 * width)
        yield StressCase(f"pulse {width:g} s wide", partial(_shaken, pulse, ERROR["default"]))
    for n_steps in (1, 100) if small else (1, 2, 3, 10, 100, 1_000, 10_000):
        yield StressCase(f"{n_steps} implicit steps", partial(_implicit, n_steps))
    for n_steps in (1, 1_000) if small else (1, 10, 1_000, 100_000, 1_000_000):
        yield StressCase(f"{n_steps} explicit steps", partial(_explicit, n_steps))
    for n_loads in (1, 100) if small else (1, 10, 1_000, 100_000):
        yield StressCase(f"{n_loads} load steps", partial(_static, n_loads))


def _at_frequency(frequency: float, accuracy: str) -> StressCase:
    motion = Harmonic(min(2.0, 60.0 / frequency), frequency, 0.8)
    duration = 1.0 / frequency if frequency < 5.0 else min(3.0 / frequency, 0.1)
    case = shaken(squares(5), motion, duration=duration, frequency=frequency, accuracy=accuracy)
    attempt = partial(_shaken, case, ERROR[accuracy])
    return StressCase(f"{frequency:g} Hz, accuracy {accuracy}", attempt)


def _shaken(case: StressScene, error: float) -> Sequence[Check]:
    return motions_as_advised(case, np.linspace(0.0, case.scene.loads.duration, 51), error)


def _small() -> StressScene:
    return shaken(squares(3), Harmonic(2.0, 10.0, 0.8), duration=DURATION, frequency=10.0)


def _implicit(n_steps: int) -> Sequence[Check]:
    """As many steps as asked for, or more: what they say, not how well they resolve the drive."""
    case, times = _small(), np.linspace(0.0, DURATION, n_steps + 1)
    solver = ImplicitSolver(case.topology, times, times[-1:])
    answer = solved(case, solver)
    assert isinstance(answer.record, ImplicitRecord)
    states = answer.record.u[:, 0]
    return [
        *admissible(case, states[:: max(1, len(states) // 100)]),
        *stages(case, solver, answer.record),
        Check("asked times that are no steps", len(np.setdiff1d(times, answer.record.times)), 0),
    ]


def _explicit(n_steps: int) -> Sequence[Check]:
    case, asked = _small(), np.linspace(0.0, DURATION, 51)
    solver = ExplicitSolver(case.topology, DURATION, n_steps, asked)
    return motions(case, asked, 0.05, solver)


def _static(n_loads: int) -> Sequence[Check]:
    case = pressed(squares(3), 0.1)
    loads = np.arange(1, n_loads + 1) / n_loads
    answer = solved(case, StaticSolver(case.topology, loads))
    last = slice(-1, None, -max(1, n_loads // 20))
    chosen = answer._replace(displacement=answer.displacement[last])
    return [
        *admissible(case, chosen.displacement),
        *balanced(case, chosen),
        reached(case, chosen.displacement, loads[last]),
    ]
