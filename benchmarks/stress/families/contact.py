"""Tries contact at its barrier and cutoff, and inputs of 32 bits, none, far too large."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.stress import (
    LAWS,
    Check,
    ExpectedVerdict,
    StressCase,
    StressScene,
    attempt,
    equilibria,
    family,
    largest_difference,
    motions,
    posed,
    pressed,
    shaken,
    solved,
    squares,
)
from sim.quasistatics import StaticSolver
from sim.solvers import Harmonic, PrescribedMotion, Solver, TimeSeries, solve_case
from sim.structure import ConcreteParameters
from sim.time_integration import ExplicitSolver, ImplicitSolver

HARD_DRIVE = Harmonic(8.0, 30.0, 0.6)
CHAOTIC_ERROR = 0.1
"""What half the steps may change where units collide again and again."""


@family
def barrier(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    side = 5 if small else 9
    yield from _initial_angles((-14.99, -16.0) if small else (-14.99, -15.0, -16.0, -40.0))
    for share in (0.25,) if small else (0.05, 0.1, 0.15, 0.2, 0.25):
        for law, contact in LAWS.items():
            for n_loads in (1,) if small else (1, 10):
                case = pressed(squares(side), share, contact=contact)
                loads = np.arange(1, n_loads + 1) / n_loads
                name = f"pressed by {share:.0%} in {n_loads} loads, contact on {law}"
                yield attempt(name, equilibria, case, loads)
    for law, contact in LAWS.items():
        case = shaken(squares(side), HARD_DRIVE, duration=0.05, frequency=30.0, contact=contact)
        yield attempt(f"8 mm at 30 Hz, contact on {law}", motions, case, 101, CHAOTIC_ERROR)
    case = shaken(squares(5), HARD_DRIVE, duration=0.02, frequency=30.0)
    for n_steps in (1,) if small else (1, 10, 100):
        yield attempt(f"{n_steps} explicit steps asked for", _too_large, case, n_steps)


def _initial_angles(angles: Sequence[float]) -> Iterator[StressCase]:
    for angle in angles:
        lattice = squares(5, bias=45.0 - angle / 2)
        beyond = angle <= -15.0
        for share in (0.02, -0.05):
            name = f"voids of {angle:g} deg at rest, {'pressed' if share > 0 else 'pulled'}"
            plate = pressed(lattice, share)
            expected: ExpectedVerdict = "refusal" if beyond else "solution"
            yield attempt(name, equilibria, plate, np.array([0.0, 0.5, 1.0]), expected=expected)
        gentle = shaken(lattice, Harmonic(0.2, 30.0), duration=0.01, frequency=30.0)
        for integrator in ("implicit", "explicit"):
            case = replace(gentle, scene=gentle.scene.updated(integrator=integrator))
            name = f"voids of {angle:g} deg at rest, shaken, {integrator}"
            yield attempt(
                name, motions, case, 101, CHAOTIC_ERROR, expected="refusal" if beyond else "either"
            )
    yield from _beyond_barrier()


def _beyond_barrier() -> Iterator[StressCase]:
    """Yields held units that are beyond the barrier from the first moment, or get there."""
    for start, sense in ((-2.0, "further"), (-2.0, "back")):
        end = -3.0 if sense == "further" else 0.0
        series = TimeSeries(np.array([0.0, 0.01]), np.array([[0, 0, start], [0, 0, end]]))
        case = posed(squares(3), [0], [4], series, duration=0.01)
        times = np.linspace(0.0, 0.01, 11)
        implicit = ImplicitSolver(case.topology, times, times)
        explicit = ExplicitSolver(case.topology, 0.01, 100, times)
        for name, solver in (("implicit", implicit), ("explicit", explicit)):
            said = f"turned beyond the barrier at once, then {sense}, {name}"
            yield attempt(said, motions, case, times, CHAOTIC_ERROR, solver, expected="refusal")


def _too_large(case: StressScene, n_steps: int) -> Sequence[Check]:
    asked = np.array([case.scene.loads.duration])
    solver = ExplicitSolver(case.topology, case.scene.loads.duration, n_steps, asked)
    return motions(case, asked, CHAOTIC_ERROR, solver)


LOADS = np.array([0.5, 1.0])
DURATION = 0.01
ASKED = np.linspace(0.0, DURATION, 11)
SINGLE = 1e-4
"""Change of an answer by 32-bit input, relative: 1e-7 times what a lattice makes of it."""


@family
def inputs(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    for name, solver in _solvers():
        yield attempt(f"32-bit parameters, {name}", _single, name, solver)
    sizes = (0.0, 1e-12) if small else (0.0, 1e-12, 1e-9, 1e-6, 1e-3)
    for offset in sorted({sign * size for sign in (1, -1) for size in sizes}):
        lattice = squares(5, bias=50.0 - offset / 2)
        name = f"voids at the cutoff {offset:+g} deg"
        for share in (1e-6, 0.02):
            plate = pressed(lattice, share)
            yield attempt(f"{name}, pressed by {share:g}", equilibria, plate, LOADS)
        for integrator in ("implicit", "explicit"):
            case = shaken(
                lattice, Harmonic(0.5, 60.0), duration=0.01, frequency=60.0, integrator=integrator
            )
            yield attempt(f"{name}, shaken, {integrator}", motions, case, ASKED, 0.1)
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
        Check("change by 32-bit input", largest_difference(case, whole, answer), SINGLE),
    ]


def _nonsense() -> Iterator[StressCase]:
    for name, solver in _solvers():
        for field in ("arm", "vector", "void", "law", "contact", "mass", "damping"):
            for value in (np.nan, np.inf):
                said = f"{field} is {value}, {name}"
                yield attempt(said, _corrupted, name, solver, field, value, expected="refusal")
        for field, value in (("mass", 0.0), ("mass", -1.0), ("law", -1.0), ("damping", -1e3)):
            if name == "static" and field != "law":
                continue
            said = f"{field} is {value:g}, {name}"
            yield attempt(said, _corrupted, name, solver, field, value, expected="refusal")


def _corrupted(name: str, solver: Solver, field: str, value: float) -> Sequence[Check]:
    case = pressed(squares(5), 0.05) if name == "static" else _case()
    bad = np.array(getattr(case.values, field))
    bad.flat[len(bad.flat) // 2] = value
    solve_case(solver, case.values._replace(**{field: bad}), case.drive)
    return [Check("answers without a meaning", 1, 0)]
