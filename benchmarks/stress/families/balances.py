"""Energy and momentum over long runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks.stress import (
    LAWS,
    Answer,
    Check,
    StressCase,
    StressFamily,
    StressScene,
    admissible,
    balance,
    energies,
    posed,
    solved,
    squares,
    work,
)
from sim.core import Floats
from sim.solvers import TimeSeries
from sim.structure import shape
from sim.time_integration import ExplicitSolver, ImplicitSolver

SIDE = 4
PUSHED = 2e-3
"""The drive is over then, s."""


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "balances",
        "a unit pushed and turned once, then held: free or clamped lattices, undamped, damped, with"
        " and without contact, up to 100 000 explicit steps, implicit steps",
        "energy against work and damping, momentum against the impulse of the held units, by the"
        " definition at every output",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
    for n_steps in (2_000,) if small else (2_000, 20_000, 100_000):
        for bias, kind in ((20.0, "without contact"), (46.0, "with contact")):
            attempt = partial(_kept, _pushed(bias), n_steps)
            yield StressCase(f"undamped for {n_steps} steps, {kind}", attempt)
    touching = _pushed(46.0, contact=LAWS["distances"])
    yield StressCase("undamped, contact on distances", partial(_kept, touching, 2_000))
    for bias in (46.0,) if small else (20.0, 46.0):
        yield StressCase(f"damped, squares turned by {bias:g} deg", partial(_spent, _pushed(bias)))
        yield StressCase(f"implicit, squares turned by {bias:g} deg", partial(_lost, _pushed(bias)))
        yield StressCase(
            f"free, squares turned by {bias:g} deg", partial(_momentum, _pushed(bias, []))
        )


def _pushed(bias: float, clamped: Sequence[int] = (0,), **more: Any) -> StressScene:  # noqa: ANN401
    """Undamped squares, the middle one pushed and turned within PUSHED, then held."""
    times = np.linspace(0.0, PUSHED, 41)
    share = (1.0 - np.cos(np.pi * times / PUSHED)) / 2.0
    series = TimeSeries(times, share[:, None] * np.array([1.5, 0.8, 0.06]))
    made = posed(squares(SIDE, bias=bias), list(clamped), [SIDE + 1], series, **more)
    return made.with_material(damping_translation=0.0, damping_rotation=0.0)


def _run(case: StressScene, n_steps: int, asked: Floats) -> Answer:
    """Explicit steps of 20 microseconds, less than half the limit."""
    return solved(case, ExplicitSolver(case.topology, float(asked[-1]), n_steps, asked))


def _kept(case: StressScene, n_steps: int) -> Sequence[Check]:
    asked = np.linspace(PUSHED, 2e-5 * n_steps, 100)
    answer = _run(case, n_steps, asked)
    energy = energies(case, answer)
    drift = float(np.abs(energy - energy[0]).max() / energy[0])
    return [*admissible(case, answer.displacement), Check("drift of the energy", drift, 1e-2)]


def _spent(case: StressScene) -> Sequence[Check]:
    damped = case.with_material(damping_translation=1e-4, damping_rotation=5e-3)
    asked = np.linspace(0.0, 0.01, 2001)
    answer = _run(damped, 500, asked)
    done, lost = work(damped, answer, asked)
    energy = energies(damped, answer)
    off = float(np.abs(energy - done + lost).max() / done.max())
    return [Check("energy off work and damping", off, 1e-2)]


def _lost(case: StressScene) -> Sequence[Check]:
    """An L-stable method may lose energy but never gain any."""
    asked = np.linspace(0.0, 0.01, 2001)
    solver = ImplicitSolver(case.topology, asked[::4], asked, tolerance=1e-6)
    answer = solved(case, solver)
    done, _ = work(case, answer, asked)
    gained = float((energies(case, answer) - done).max() / done.max())
    return [Check("energy gained by implicit steps", gained, 1e-2)]


def _momentum(case: StressScene) -> Sequence[Check]:
    """Impulse and angular impulse of the one held unit against the momentum of all others."""
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
