"""Numbers as they come: of 32 bits, whole, at the cutoff to the last digit, far too large."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks.stress.checks import apart, equilibria, motions, solved
from benchmarks.stress.frame import Case, Check, Family
from benchmarks.stress.posed import Posed, pressed, shaken, squares
from sim.dynamics import Drive, Solver, solve_case
from sim.explicit import ExplicitSolver
from sim.implicit import ImplicitSolver
from sim.loads import Harmonic, TimeSeries
from sim.model import Values
from sim.statics import StaticSolver

LOADS = np.array([0.5, 1.0])
DURATION = 0.01
ASKED = np.linspace(0.0, DURATION, 11)
SINGLE = 1e-4
"""Change of an answer by 32-bit input, relative: 1e-7 times what a lattice makes of it."""


def family() -> Family:
    """The family."""
    return Family(
        "inputs",
        "parameters, drives and times of 32 bits; void angles at the cutoff of contact and up to"
        " 1e-12 deg beside it; parameters that are no numbers, zero, negative, huge",
        "the answer of 64 bits, as 64 bits; balance by the definition; a refusal of what is none",
        _cases,
    )


def _cases(small: bool) -> Iterator[Case]:
    for name, solver in _solvers():
        yield Case(f"32-bit parameters, {name}", partial(_single, name, solver))
    sizes = (0.0, 1e-12) if small else (0.0, 1e-12, 1e-9, 1e-6, 1e-3)
    for offset in sorted({sign * size for sign in (1, -1) for size in sizes}):
        lattice = squares(5, bias=50.0 - offset / 2)
        name = f"voids at the cutoff {offset:+g} deg"
        for share in (1e-6, 0.02):
            plate = pressed(lattice, share)
            yield Case(f"{name}, pressed by {share:g}", partial(equilibria, plate, LOADS))
        for integrator in ("implicit", "explicit"):
            case = shaken(
                lattice, Harmonic(0.5, 60.0), duration=0.01, frequency=60.0, integrator=integrator
            )
            yield Case(f"{name}, shaken, {integrator}", partial(motions, case, ASKED, 0.1))
    yield from _nonsense()


def _solvers() -> Iterator[tuple[str, Solver]]:
    plate, case = pressed(squares(5), 0.05), _case()
    yield "static", StaticSolver(plate.topology, LOADS.astype(np.float32))
    times = np.linspace(0.0, DURATION, 101)
    yield "implicit", ImplicitSolver(case.topology, times, ASKED)
    yield "explicit", ExplicitSolver(case.topology, DURATION, 400, ASKED)


def _case() -> Posed:
    times = np.linspace(0.0, DURATION, 21)
    share = np.sin(np.pi * times / DURATION) ** 2
    series = TimeSeries(times, share[:, None] * np.array([1.0, 0.5, 0.05]))
    return shaken(squares(5), series, duration=DURATION)


def _single(name: str, solver: Solver) -> Sequence[Check]:
    case = pressed(squares(5), 0.05) if name == "static" else _case()
    whole = solved(case, solver)
    rounded: Any = Values(*(np.float32(part) for part in case.values))
    motion = case.drive.motion
    if isinstance(motion, TimeSeries):
        single: Any = [np.asarray(part, dtype=np.float32) for part in motion]
        motion = TimeSeries(*single)
    displacement, velocity, record = solve_case(solver, rounded, Drive(case.drive.units, motion))
    answer = whole._replace(displacement=displacement, velocity=velocity, record=record)
    wide = displacement.dtype == np.float64 and velocity.dtype == np.float64
    return [
        Check("answer is not of 64 bits", int(not wide), 0),
        Check("change by 32-bit input", apart(case, whole, answer), SINGLE),
    ]


def _nonsense() -> Iterator[Case]:
    for name, solver in _solvers():
        for field in ("arm", "vector", "void", "law", "contact", "mass", "damping"):
            for value in (np.nan, np.inf):
                attempt = partial(_spoilt, name, solver, field, value)
                said = f"{field} is {value}, {name}"
                yield Case(said, attempt, "refusal")
        for field, value in (("mass", 0.0), ("mass", -1.0), ("law", -1.0), ("damping", -1e3)):
            if name == "static" and field != "law":
                continue
            attempt = partial(_spoilt, name, solver, field, value)
            yield Case(f"{field} is {value:g}, {name}", attempt, "refusal")


def _spoilt(name: str, solver: Solver, field: str, value: float) -> Sequence[Check]:
    """One number of a field replaced."""
    case = pressed(squares(5), 0.05) if name == "static" else _case()
    bad = np.array(getattr(case.values, field))
    bad.flat[len(bad.flat) // 2] = value
    solve_case(solver, case.values._replace(**{field: bad}), case.drive)
    return [Check("answers without a meaning", 1, 0)]
