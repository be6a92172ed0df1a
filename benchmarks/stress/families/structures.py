"""Tries lattices from 3 x 3 to 120 x 120 units, and structures in pieces."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.stress import (
    LAWS,
    NONE,
    Check,
    ExpectedVerdict,
    StressCase,
    StressScene,
    attempt,
    equilibria,
    family,
    motions,
    posed,
    pressed,
    shaken,
    squares,
)
from sim.core import Ints
from sim.scene import Clamp, Evaluator, make_plan
from sim.solvers import Harmonic, LinearRamp
from sim.structure import Lattice, quads
from sim.time_integration import ExplicitSolver, ImplicitSolver

SIDES = (3, 4, 5, 8, 15, 30, 60, 120)
TOUCHING = 30
"""Largest lattice that is also pressed with contact on distances."""


@family
def sizes(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    shapes = [(side, side) for side in SIDES] + [(60, 2), (3, 40), (2, 2)]
    for columns, rows in [(3, 3), (8, 8)] if small else shapes:
        lattice, name = squares(columns, rows), f"{columns} x {rows}"
        loads = np.array([1.0])
        expected: ExpectedVerdict = "solution" if columns > 2 else "refusal"  # or no unit is free
        yield attempt(
            f"{name}, pressed", equilibria, pressed(lattice, 0.1), loads, expected=expected
        )
        if max(columns, rows) <= TOUCHING:
            touching = pressed(lattice, 0.1, contact=LAWS["distances"])
            said = f"{name}, contact on distances"
            yield attempt(said, equilibria, touching, loads, expected=expected)
        if min(columns, rows) > 2:
            case = shaken(lattice, Harmonic(1.0, 60.0, 0.8), duration=2e-3, frequency=60.0)
            for integrator in ("implicit", "explicit"):
                yield attempt(f"{name}, shaken, {integrator}", _shaken, case, integrator)


def _shaken(case: StressScene, integrator: str) -> Sequence[Check]:
    duration, asked = case.scene.loads.duration, np.linspace(0.0, case.scene.loads.duration, 6)
    if integrator == "explicit":
        return motions(case, asked, 0.05, ExplicitSolver(case.topology, duration, 50, asked))
    times = np.linspace(0.0, duration, 41)
    return motions(case, asked, 0.05, ImplicitSolver(case.topology, times, asked))


LOADS = np.array([0.5, 1.0])
SIDE = 5
ASKED = np.linspace(0.0, 0.02, 21)
HUM_DRIVE = Harmonic(0.5, 60.0)


@family
def pieces(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    for name, lattice, expected in list(_structures())[:2] if small else _structures():
        plate = pressed(lattice, 0.04)
        yield attempt(f"{name}, pressed", equilibria, plate, LOADS, expected=expected)
        for integrator in ("implicit", "explicit"):
            case = shaken_ends(lattice, integrator)
            more: ExpectedVerdict = "solution" if len(lattice.ligaments) else "refusal"
            yield attempt(
                f"{name}, shaken, {integrator}", motions, case, ASKED, 0.15, expected=more
            )
    yield from _odd()
    for unit in (6,) if small else (0, 6, 7, 12, 17):
        for static in (True, False):
            kind = "pressed" if static else "shaken"
            yield attempt(f"cloak of unit {unit}, {kind}", _cloak, unit, static)


def _structures() -> Iterator[tuple[str, Lattice, ExpectedVerdict]]:
    """Yields lattices, and whether they have a stable equilibrium under a load."""
    whole = squares(SIDE)
    yield "a whole lattice", whole, "solution"
    yield "a floating unit", _cut(whole, np.array([12])), "refusal"
    yield "a unit on one ligament", _cut(whole, np.array([12]), keep=1), "solution"
    yield "two halves", _cut(whole, np.flatnonzero(whole.index[:, 0] < 2)), "solution"
    yield "a floating island", _cut(whole, np.array([6, 7, 11, 12])), "refusal"
    yield "no ligament", replace(whole, ligaments=whole.ligaments[:0]), "refusal"


def _cut(lattice: Lattice, units: Ints, keep: int = 0) -> Lattice:
    """Cuts all but ``keep`` of the ligaments between these units and the others."""
    inside = np.isin(lattice.ligament_units, units)
    crossing = np.flatnonzero(inside[:, 0] != inside[:, 1])[keep:]
    return replace(lattice, ligaments=np.delete(lattice.ligaments, crossing, axis=0))


def shaken_ends(lattice: Lattice, integrator: str) -> StressScene:
    """Clamps the left column, shakes the right one."""
    left, right = (np.flatnonzero(lattice.index[:, 0] == end) for end in (0, SIDE - 1))
    motion = Harmonic(0.5, 60.0, 0.3)
    return posed(lattice, left, right, motion, duration=0.02, frequency=60.0, integrator=integrator)


def _odd() -> Iterator[StressCase]:
    """Yields what hardly is a lattice any more."""
    free = posed(squares(3), NONE, [4], LinearRamp(1.0, 1.0), static=True)
    said = "held by nothing but the driven unit"
    yield attempt(said, equilibria, free, LOADS, expected="refusal")
    chain = quads(2, 1, 15.0, 2.25, 0.3)
    held = posed(chain, [0], [1], LinearRamp(0.5, 1.0), static=True)
    yield attempt("all units held, static", equilibria, held, LOADS, expected="refusal")
    for integrator in ("implicit", "explicit"):
        more = {"duration": 0.02, "frequency": 60.0, "integrator": integrator}
        said, moving = f"all units held, {integrator}", posed(chain, [0], [1], HUM_DRIVE, **more)
        yield attempt(said, motions, moving, ASKED, 0.05, expected="refusal")
    sliding = pressed(squares(SIDE), 0.04)
    along = sliding.scene.updated(supports=(Clamp(5 * np.arange(5), ("ux",)),))
    yield attempt("clamped along x alone", equilibria, replace(sliding, scene=along), LOADS)
    alone = posed(quads(1, 1, 15.0, 2.25, 0.3), NONE, [0], LinearRamp(1.0, 1.0), static=True)
    yield attempt("a single unit, driven", equilibria, alone, LOADS, expected="refusal")


def _cloak(unit: int, static: bool) -> Sequence[Check]:
    """Compares the slope of the loss along a random direction with differences of it."""
    lattice = squares(SIDE)
    case = (
        pressed(lattice, 0.05)
        if static
        else shaken(lattice, Harmonic(1.0, 2.0, 0.4), duration=0.1, frequency=2.0)
    )
    one = np.array([unit])
    scene = case.scene.updated(cloak=one, region=one, frozen=NONE, samples=21)
    scene = scene.updated(kind="strain_energy", steps=2 if static else None)
    evaluate = Evaluator(scene, make_plan(scene))
    direction = np.random.default_rng(unit).normal(size=scene.space.n_variables)
    start = np.zeros(scene.space.n_variables)
    slope = evaluate(start)[1] @ direction
    step = 1e-4
    losses = [evaluate(start + factor * step * direction)[0] for factor in (-2, -1, 1, 2)]
    expected = float(np.dot([1, -8, 8, -1], losses) / (12 * step))
    return [
        Check("slope of the loss off its differences", float(abs(slope / expected - 1.0)), 1e-5)
    ]
