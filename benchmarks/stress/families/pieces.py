"""Structures in pieces: disconnected, floating, held by a thread, one unit, one-unit cloaks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.stress import (
    NONE,
    Check,
    StressCase,
    StressFamily,
    StressScene,
    Wanted,
    equilibria,
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

LOADS = np.array([0.5, 1.0])
SIDE = 5
ASKED = np.linspace(0.0, 0.02, 21)


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "pieces",
        "floating units and halves, ends that hang on one ligament, supports along x alone, all"
        " units held, no ligament, a single unit; cloaks of one unit",
        "equilibria and motions as elsewhere; gradients of the loss against differences",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
    for name, lattice, wanted in list(_structures())[:2] if small else _structures():
        plate = pressed(lattice, 0.04)
        yield StressCase(f"{name}, pressed", partial(equilibria, plate, LOADS), wanted)
        for integrator in ("implicit", "explicit"):
            case = shaken_ends(lattice, integrator)
            more: Wanted = "solution" if len(lattice.ligaments) else "refusal"
            attempt = partial(motions, case, ASKED, 0.15)
            yield StressCase(f"{name}, shaken, {integrator}", attempt, more)
    yield from _odd()
    for unit in (6,) if small else (0, 6, 7, 12, 17):
        for static in (True, False):
            kind = "pressed" if static else "shaken"
            yield StressCase(f"cloak of unit {unit}, {kind}", partial(_cloak, unit, static))


def _structures() -> Iterator[tuple[str, Lattice, Wanted]]:
    """Lattices, and whether they have a stable equilibrium under a load."""
    whole = squares(SIDE)
    yield "a whole lattice", whole, "solution"
    yield "a floating unit", _cut(whole, np.array([12])), "refusal"
    yield "a unit on one ligament", _cut(whole, np.array([12]), keep=1), "solution"
    yield "two halves", _cut(whole, np.flatnonzero(whole.index[:, 0] < 2)), "solution"
    yield "a floating island", _cut(whole, np.array([6, 7, 11, 12])), "refusal"
    yield "no ligament", replace(whole, ligaments=whole.ligaments[:0]), "refusal"


def _cut(lattice: Lattice, units: Ints, keep: int = 0) -> Lattice:
    """Without all but ``keep`` of the ligaments between these units and the others."""
    inside = np.isin(lattice.ligament_units, units)
    crossing = np.flatnonzero(inside[:, 0] != inside[:, 1])[keep:]
    return replace(lattice, ligaments=np.delete(lattice.ligaments, crossing, axis=0))


def shaken_ends(lattice: Lattice, integrator: str) -> StressScene:
    """The left column clamped, the right one shaken."""
    left, right = (np.flatnonzero(lattice.index[:, 0] == end) for end in (0, SIDE - 1))
    motion = Harmonic(0.5, 60.0, 0.3)
    return posed(lattice, left, right, motion, duration=0.02, frequency=60.0, integrator=integrator)


def _odd() -> Iterator[StressCase]:
    """What hardly is a lattice any more."""
    free = posed(squares(3), NONE, [4], LinearRamp(1.0, 1.0), static=True)
    yield StressCase("held by nothing but the driven unit", partial(equilibria, free, LOADS))
    chain = quads(2, 1, 15.0, 2.25, 0.3)
    held = posed(chain, [0], [1], LinearRamp(0.5, 1.0), static=True)
    yield StressCase("all units held, static", partial(equilibria, held, LOADS), "refusal")
    for integrator in ("implicit", "explicit"):
        more = {"duration": 0.02, "frequency": 60.0, "integrator": integrator}
        moving = posed(chain, [0], [1], Harmonic(0.5, 60.0), **more)
        attempt = partial(motions, moving, ASKED, 0.05)
        yield StressCase(f"all units held, {integrator}", attempt, "refusal")
    sliding = pressed(squares(SIDE), 0.04)
    along = sliding.scene.updated(supports=(Clamp(5 * np.arange(5), ("ux",)),))
    yield StressCase(
        "clamped along x alone", partial(equilibria, replace(sliding, scene=along), LOADS)
    )
    alone = posed(quads(1, 1, 15.0, 2.25, 0.3), NONE, [0], LinearRamp(1.0, 1.0), static=True)
    yield StressCase("a single unit, driven", partial(equilibria, alone, LOADS), "refusal")


def _cloak(unit: int, static: bool) -> Sequence[Check]:
    """Slope of the loss along a random direction against differences of it."""
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
    wanted = float(np.dot([1, -8, 8, -1], losses) / (12 * step))
    return [Check("slope of the loss off its differences", float(abs(slope / wanted - 1.0)), 1e-5)]
