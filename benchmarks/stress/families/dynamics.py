"""Tries constants far from the paper's, 0.1 to 200 Hz, 1 to a million steps; balances energy."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from benchmarks.scenes import MATERIAL
from benchmarks.stress import (
    LAWS,
    Answer,
    Check,
    StressCase,
    StressScene,
    attempt,
    balance,
    check_admissible,
    check_balance,
    check_held_dofs,
    energies,
    equilibria,
    family,
    motions,
    motions_as_advised,
    posed,
    pressed,
    shaken,
    solved,
    squares,
    stages,
    work,
)
from sim.core import Floats
from sim.quasistatics import StaticSolver
from sim.solvers import Harmonic, Pulse, TimeSeries
from sim.structure import shape
from sim.time_integration import ExplicitSolver, ImplicitRecord, ImplicitSolver

SIDE = 5
LOADS = np.array([0.5, 1.0])


@family
def constants(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    for ratio in (1e3,) if small else 10.0 ** np.arange(-3, 7):
        for name, constants in _stiffness(float(ratio)):
            yield from _press_and_shake(f"{name} {ratio:.0e}", constants, stiff=True)
    for factor in (0.0,) if small else (0.0, 1e-3, 1e3, 1e6, 1e9):
        yield from _press_and_shake(f"damping times {factor:.0e}", _damping(factor))
    for seed in range(1 if small else 8):
        exponent = np.random.default_rng(seed).uniform(-3.0, 3.0, SIDE * SIDE)
        spread = {"density": MATERIAL.density * 10.0**exponent}
        yield from _press_and_shake(f"masses over 6 decades, draw {seed}", spread)
    for factor in () if small else (1e-3, 1e3, 1e6):
        yield from _press_and_shake(
            f"masses times {factor:.0e}", {"density": MATERIAL.density * factor}
        )


def _stiffness(ratio: float) -> Iterator[tuple[str, dict[str, Any]]]:
    for name in ("axial", "shear", "bending", "contact"):
        key = f"{name}_stiffness"
        yield f"{name} stiffness times", {key: getattr(MATERIAL, key) * ratio}
    units = squares(SIDE).ligament_units
    factor = np.where(np.isin(units, [6, 7, 11]).any(axis=1), ratio, 1.0)
    yield (
        "an inclusion of stiffness",
        {
            f"{name}_stiffness": getattr(MATERIAL, f"{name}_stiffness") * factor
            for name in ("axial", "shear", "bending")
        },
    )


def _damping(factor: float) -> dict[str, Any]:
    names = ("damping_translation", "damping_rotation")
    return {name: getattr(MATERIAL, name) * factor for name in names}


def _press_and_shake(
    name: str, constants: dict[str, Any], stiff: bool = False
) -> Iterator[StressCase]:
    """Presses a structure of these constants, and shakes it slowly and fast."""
    if stiff:
        plate = pressed(squares(SIDE), 0.08).with_material(**constants)
        yield attempt(f"{name}, pressed", equilibria, plate, LOADS)
    for frequency, duration in ((2.0, 0.25), (60.0, 0.02)):
        motion = Harmonic(2.0, frequency, 0.8)
        case = shaken(squares(SIDE), motion, duration=duration, frequency=frequency)
        made = case.with_material(**constants)
        yield attempt(f"{name}, shaken at {frequency:g} Hz", motions_as_advised, made, 26, 0.05)


DURATION = 0.1
ERROR = {"draft": 0.2, "default": 0.05, "tight": 5e-3}


@family
def times(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    few = (0.1, 200.0)
    for frequency in few if small else (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 200.0):
        for accuracy in ("default",) if small else ("draft", "default", "tight"):
            if accuracy == "tight" and frequency < 1.0:
                continue  # 170 000 steps a second
            yield _at_frequency(frequency, accuracy)
    for width in (1e-3,) if small else (1e-4, 1e-3, 1e-2):
        pulse = shaken(squares(5), Pulse(1.0, width, 0.4, 4 * width), duration=8 * width)
        yield attempt(f"pulse {width:g} s wide", motions_as_advised, pulse, 51, ERROR["default"])
    for n_steps in (1, 100) if small else (1, 2, 3, 10, 100, 1_000, 10_000):
        yield attempt(f"{n_steps} implicit steps", _implicit, n_steps)
    for n_steps in (1, 1_000) if small else (1, 10, 1_000, 100_000, 1_000_000):
        yield attempt(f"{n_steps} explicit steps", _explicit, n_steps)
    for n_loads in (1, 100) if small else (1, 10, 1_000, 100_000):
        yield attempt(f"{n_loads} load steps", _static, n_loads)


def _at_frequency(frequency: float, accuracy: str) -> StressCase:
    motion = Harmonic(min(2.0, 60.0 / frequency), frequency, 0.8)
    duration = 1.0 / frequency if frequency < 5.0 else min(3.0 / frequency, 0.1)
    case = shaken(squares(5), motion, duration=duration, frequency=frequency, accuracy=accuracy)
    return attempt(
        f"{frequency:g} Hz, accuracy {accuracy}", motions_as_advised, case, 51, ERROR[accuracy]
    )


def _small_scene() -> StressScene:
    return shaken(squares(3), Harmonic(2.0, 10.0, 0.8), duration=DURATION, frequency=10.0)


def _implicit(n_steps: int) -> Sequence[Check]:
    """Checks as many steps as asked for, or more, not how well they resolve the drive."""
    case, times = _small_scene(), np.linspace(0.0, DURATION, n_steps + 1)
    solver = ImplicitSolver(case.topology, times, times[-1:])
    answer = solved(case, solver)
    assert isinstance(answer.record, ImplicitRecord)
    states = answer.record.u[:, 0]
    return [
        *check_admissible(case, states[:: max(1, len(states) // 100)]),
        *stages(case, solver, answer.record),
        Check("asked times that are no steps", len(np.setdiff1d(times, answer.record.times)), 0),
    ]


def _explicit(n_steps: int) -> Sequence[Check]:
    case, asked = _small_scene(), np.linspace(0.0, DURATION, 51)
    solver = ExplicitSolver(case.topology, DURATION, n_steps, asked)
    return motions(case, asked, 0.05, solver)


def _static(n_loads: int) -> Sequence[Check]:
    case = pressed(squares(3), 0.1)
    loads = np.arange(1, n_loads + 1) / n_loads
    answer = solved(case, StaticSolver(case.topology, loads))
    last = slice(-1, None, -max(1, n_loads // 20))
    chosen = answer._replace(displacement=answer.displacement[last])
    return [
        *check_admissible(case, chosen.displacement),
        *check_balance(case, chosen),
        check_held_dofs(case, chosen.displacement, loads[last]),
    ]


WIDTH = 4
PUSHED = 2e-3
"""The drive is over then, s."""


@family
def balances(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    for n_steps in (2_000,) if small else (2_000, 20_000, 100_000):
        for bias, kind in ((20.0, "without contact"), (46.0, "with contact")):
            yield attempt(
                f"undamped for {n_steps} steps, {kind}", _energy_kept, _pushed(bias), n_steps
            )
    touching = _pushed(46.0, contact=LAWS["distances"])
    yield attempt("undamped, contact on distances", _energy_kept, touching, 2_000)
    for bias in (46.0,) if small else (20.0, 46.0):
        yield attempt(f"damped, squares turned by {bias:g} deg", _spent, _pushed(bias))
        yield attempt(f"implicit, squares turned by {bias:g} deg", _lost, _pushed(bias))
        yield attempt(f"free, squares turned by {bias:g} deg", _momentum, _pushed(bias, []))


def _pushed(bias: float, clamped: Sequence[int] = (0,), **more: Any) -> StressScene:  # noqa: ANN401
    """Pushes and turns the middle of undamped squares within PUSHED, then holds it."""
    times = np.linspace(0.0, PUSHED, 41)
    share = (1.0 - np.cos(np.pi * times / PUSHED)) / 2.0
    series = TimeSeries(times, share[:, None] * np.array([1.5, 0.8, 0.06]))
    made = posed(squares(WIDTH, bias=bias), list(clamped), [WIDTH + 1], series, **more)
    return made.with_material(damping_translation=0.0, damping_rotation=0.0)


def _run(case: StressScene, n_steps: int, asked: Floats) -> Answer:
    """Takes explicit steps of 20 microseconds, less than half the limit."""
    return solved(case, ExplicitSolver(case.topology, float(asked[-1]), n_steps, asked))


def _energy_kept(case: StressScene, n_steps: int) -> Sequence[Check]:
    asked = np.linspace(PUSHED, 2e-5 * n_steps, 100)
    answer = _run(case, n_steps, asked)
    energy = energies(case, answer)
    drift = float(np.abs(energy - energy[0]).max() / energy[0])
    return [*check_admissible(case, answer.displacement), Check("drift of the energy", drift, 1e-2)]


def _spent(case: StressScene) -> Sequence[Check]:
    damped = case.with_material(damping_translation=1e-4, damping_rotation=5e-3)
    asked = np.linspace(0.0, 0.01, 2001)
    answer = _run(damped, 500, asked)
    done, lost = work(damped, answer, asked)
    energy = energies(damped, answer)
    off = float(np.abs(energy - done + lost).max() / done.max())
    return [Check("energy off work and damping", off, 1e-2)]


def _lost(case: StressScene) -> Sequence[Check]:
    """Checks that an L-stable method never gains energy; it may lose some."""
    asked = np.linspace(0.0, 0.01, 2001)
    solver = ImplicitSolver(case.topology, asked[::4], asked, tolerance=1e-6)
    answer = solved(case, solver)
    done, _ = work(case, answer, asked)
    gained = float((energies(case, answer) - done).max() / done.max())
    return [Check("energy gained by implicit steps", gained, 1e-2)]


def _momentum(case: StressScene) -> Sequence[Check]:
    """Compares impulse and angular impulse of the held unit with the momentum of all others."""
    asked = np.linspace(0.0, 0.01, 2001)
    answer = _run(case, 500, asked)
    n = len(asked)
    mass = case.values.mass
    centre = np.asarray(shape(case.scene.lattice, case.vertices).centroid)
    moved = answer.displacement.reshape(n, -1, 3)
    rates = answer.velocity.reshape(n, -1, 3).copy()
    rates[:, case.drive.units] = 0.0
    place = centre + moved[..., :2]
    carried = mass * rates
    angular = carried[..., 2].sum(axis=1) + _moment(place, carried[..., :2])
    pull = -np.array([balance(case.structure, state).force for state in answer.displacement])
    pull = pull.reshape(n, -1, 3)[:, case.drive.units]
    turning = pull[..., 2].sum(axis=1) + _moment(place[:, case.drive.units], pull[..., :2])
    given = np.column_stack([pull[..., :2].sum(axis=1), turning])
    steps = np.diff(asked)[:, None]
    impulse = np.cumsum((given[1:] + given[:-1]) / 2 * steps, axis=0)
    gained = np.column_stack([carried[..., :2].sum(axis=1), angular])[1:]
    off = np.abs(impulse - gained).max(axis=0) / np.abs(impulse).max(axis=0)
    return [Check("momentum off the impulse", float(off.max()), 1e-2)]


def _moment(place: Floats, force: Floats) -> Floats:
    return (place[..., 0] * force[..., 1] - place[..., 1] * force[..., 0]).sum(axis=1)
