"""Numbers as they come: of 32 bits, whole, at the cutoff to the last digit, far too large."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks.stress import (
    Check,
    StressCase,
    StressFamily,
    StressScene,
    apart,
    equilibria,
    motions,
    pressed,
    shaken,
    solved,
    squares,
)
from sim.quasistatics import StaticSolver
from sim.solvers import Harmonic, PrescribedMotion, Solver, TimeSeries, solve_case
from sim.structure import ConcreteParameters
from sim.time_integration import ExplicitSolver, ImplicitSolver

LOADS = np.array([0.5, 1.0])
DURATION = 0.01
ASKED = np.linspace(0.0, DURATION, 11)
SINGLE = 1e-4
"""Change of an answer by 32-bit input, relative: 1e-7 times what a lattice makes of it."""


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "inputs",
        "parameters, drives and times of 32 bits; void angles at the cutoff of contact and up to"
        " 1e-12 deg beside it; parameters that are no numbers, zero, negative, huge",
        "the answer of 64 bits, as 64 bits; balance by the definition; a refusal of what is none",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
    for name, solver in _solvers():
        yield StressCase(f"32-bit parameters, {name}", partial(_single, name, solver))
    sizes = (0.0, 1e-12) if small else (0.0, 1e-12, 1e-9, 1e-6, 1e-3)
    for offset in sorted({sign * size for sign in (1, -1) for size in sizes}):
        lattice = squares(5, bias=50.0 - offset / 2)
        name = f"voids at the cutoff {offset:+g} deg"
        for share in (1e-6, 0.02):
            plate = pressed(lattice, share)
            yield StressCase(f"{name}, pressed by {share:g}", partial(equilibria, plate, LOADS))
        for integrator in ("implicit", "explicit"):
            case = shaken(
                lattice, Harmonic(0.5, 60.0), duration=0.01, frequency=60.0, integrator=integrator
            )
            yield StressCase(f"{name}, shaken, {integrator}", partial(motions, case, ASKED, 0.1))
    yield from _nonsense()


def _solvers() -> Iterator[tuple[str, Solver]]:
    plate, case = pressed(squares(5), 0.05), _case()
    yield "static", StaticSolver(plate.topology, LOADS.astype(np.float32))
    times = np.linspace(0.0, DURATION, 101)
    yield "implicit", ImplicitSolver(case.topology, times, ASKED)
    yield "explicit", ExplicitSolver(case.topology, DURATION, 400, ASKED)


def _case() -> StressScene:
    times = np.linspace(0.0, DURATION, 21)
    share = np.sin(np.pi * times / DURATION) ** 2
    series = TimeSeries(times, share[:, None] * np.array([1.0, 0.5, 0.05]))
    return shaken(squares(5), series, duration=DURATION)


def _single(name: str, solver: Solver) -> Sequence[Check]:
    case = pressed(squares(5), 0.05) if name == "static" else _case()
    whole = solved(case, solver)
    rounded: Any = ConcreteParameters(*(np.float32(part) for part in case.values))
    motion = case.drive.motion
    if isinstance(motion, TimeSeries):
        single: Any = [np.asarray(part, dtype=np.float32) for part in motion]
        motion = TimeSeries(*single)
    displacement, velocity, record = solve_case(
        solver, rounded, PrescribedMotion(case.drive.units, motion)
    )
    answer = whole._replace(displacement=displacement, velocity=velocity, record=record)
    wide = displacement.dtype == np.float64 and velocity.dtype == np.float64
    return [
        Check("answer is not of 64 bits", int(not wide), 0),
        Check("change by 32-bit input", apart(case, whole, answer), SINGLE),
    ]


def _nonsense() -> Iterator[StressCase]:
    for name, solver in _solvers():
        for field in ("arm", "vector", "void", "law", "contact", "mass", "damping"):
            for value in (np.nan, np.inf):
                attempt = partial(_spoilt, name, solver, field, value)
                said = f"{field} is {value}, {name}"
                yield StressCase(said, attempt, "refusal")
        for field, value in (("mass", 0.0), ("mass", -1.0), ("law", -1.0), ("damping", -1e3)):
            if name == "static" and field != "law":
                continue
            attempt = partial(_spoilt, name, solver, field, value)
            yield StressCase(f"{field} is {value:g}, {name}", attempt, "refusal")


def _spoilt(name: str, solver: Solver, field: str, value: float) -> Sequence[Check]:
    """One number of a field replaced."""
    case = pressed(squares(5), 0.05) if name == "static" else _case()
    bad = np.array(getattr(case.values, field))
    bad.flat[len(bad.flat) // 2] = value
    solve_case(solver, case.values._replace(**{field: bad}), case.drive)
    return [Check("answers without a meaning", 1, 0)]
