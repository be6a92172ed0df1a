"""Measures the growth of an equilibrium with the lattice: squares compressed by a tenth at once."""

from dataclasses import replace
from functools import cache, partial

import numpy as np

from benchmarks.harness import (
    Measured,
    Measurement,
    MeasuringLimits,
    Method,
    Run,
    Sample,
    Suite,
    Target,
    Tell,
    in_turn,
    measure_settings,
    result_of,
)
from benchmarks.scenes import HEAVY, work_of
from sim.energy import Topology, observe, topology
from sim.linalg import FASTEST, Storage
from sim.quasistatics import StaticSolver
from sim.solvers import LinearRamp, PrescribedMotion, concrete, held_dofs, solve_case
from sim.structure import ConcreteParameters, VoidAngleContact, parameters_at, quads

SIDES = (15, 30, 60, 120)
ALL_IN_BANDS = 60
"""Largest lattice that is also solved with a band."""
STORAGES = {"Newton, by size": SIDES[-1], "Newton, band": ALL_IN_BANDS}
"""Ways to store the tangent, with the largest lattice that each is shown on."""
COMPRESSION = 0.1
REFERENCE = "two loads on the way, each to a hundredth of the usual residual"


def suite() -> Suite:
    """Makes the suite."""
    chosen = [Method(_name(side), partial(_solve, side), repeats=3) for side in SIDES]
    banded = [
        Method(f"{_name(side)}, band", partial(_solve, side, ("band",)), repeats=2)
        for side in SIDES
        if 15 < side <= ALL_IN_BANDS
    ]
    return in_turn(
        "static",
        "equilibrium at 10 % compression from rest, squares of 15 to 120 units a side",
        (REFERENCE, partial(strict, SIDES)),
        (*chosen, *banded),
        (
            Target("exponent of time by units, 30 to 120", _exponent, at_most=1.75, aim=1.5),
            Target("energy error", _worst, at_most=1e-9),
        ),
        units=0,
        short=False,
    )


def growth(sides: tuple[int, ...], limits: MeasuringLimits, tell: Tell) -> list[Measurement]:
    """Measures every size by each of the STORAGES, each in a process of its own."""
    reference = result_of(partial(strict, sides))
    measured: list[Measurement] = []
    for storage, largest in STORAGES.items():
        for side in sides:
            if side <= largest:
                settings = ((f"{side} × {side}", float(side)),)
                method = Method(
                    storage, partial(prepare_size, storage), settings, tasks=("loss",), repeats=3
                )
                measured += measure_settings(method, reference, side**2, limits, tell)
    return measured


def _name(side: int) -> str:
    return f"{side} x {side}"


def _exponent(found: Measured) -> float:
    small, large = (
        found[_name(side)].seconds if _name(side) in found else np.nan for side in (30, 120)
    )
    return float(np.log(large / small) / np.log((120 / 30) ** 2))


def _worst(found: Measured) -> float:
    errors = [outcome.error("energy") for outcome in found.values()]
    return float(np.max(errors)) if errors else np.nan  # nan where one of them is


@cache
def _posed(side: int) -> tuple[Topology, ConcreteParameters, PrescribedMotion]:
    """Poses a lattice: ligaments 2.3 mm long, the left column clamped, the right one pushed in."""
    lattice = quads(side, side, 15.0, 2.3, np.deg2rad(20.0))
    left = side * np.arange(side)
    right = left + side - 1
    posed = topology(lattice, held_dofs(left, right), VoidAngleContact(*np.deg2rad([-15.0, -10.0])))
    drive = PrescribedMotion(right, LinearRamp(-COMPRESSION * side * lattice.spacing, 1.0))
    return posed, concrete(parameters_at(lattice, lattice.vertices, HEAVY)), drive


def strict(sides: tuple[int, ...]) -> Run:
    """Solves for the same equilibria over two loads, each to a hundredth of the usual residual."""

    def run() -> Sample:
        found: dict[str, np.ndarray] = {}
        for side in sides:
            top, values, drive = _posed(side)
            solver = StaticSolver(top, np.ones(1), relative=1e-12, substeps=2)
            states = solve_case(solver, values, drive)[0]
            found[f"energy@{side}"] = _energy(top, values, states)
        return Sample(found, {})

    return run


def prepare_size(storage: str, side: float, _: str) -> Run:
    """Prepares one size by one of the STORAGES."""
    return _solve(int(side), FASTEST if storage == "Newton, by size" else ("band",))


def _solve(side: int, storages: tuple[Storage, ...] = FASTEST) -> Run:
    top, values, drive = _posed(side)
    solver = StaticSolver(replace(top, storages=storages), np.ones(1))

    def run() -> Sample:
        states, _, record = solve_case(solver, values, drive)
        return Sample({f"energy@{side}": _energy(top, values, states)}, work_of(record))

    if side == SIDES[0]:
        run()  # compiles
    else:
        _solve(SIDES[0])
        drive.values(top.held, solver.output_times)
        drive.rates(top.held, solver.output_times)
    return run


def _energy(top: Topology, values: ConcreteParameters, states: np.ndarray) -> np.ndarray:
    seen = observe(top, values, states.reshape(len(states), -1, 3))
    return np.asarray(seen.strain_energy[-1] + seen.contact_energy[-1])
