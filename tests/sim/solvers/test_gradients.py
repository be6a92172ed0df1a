"""Gradients of the solvers are those of the discrete solutions that they return.

Each quantity is varied along a random direction of its own: relative for constants, mm for the
design. The Taylor test takes the steps of ``TAYLOR``; with contact those of ``TAYLOR_IN_CONTACT``,
so small that no void of the compared states crosses the contact's cutoff (asserted): there the
energy's third derivative jumps. Newton's iterations stop far below the compared differences.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial

import jax
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from numpy.typing import NDArray

import sim
from benchmarks.scenes import CUTOFF
from sim.core import Floats
from sim.quasistatics import StaticSolver
from sim.solvers import (
    DISPLACEMENT,
    FORCE,
    Solver,
    Superposition,
    adjoint_cases,
    concrete,
    solve_cases,
)
from sim.time_integration import (
    BLANES_MOAN,
    LEAPFROG,
    ExplicitSolver,
    ImplicitSolver,
)
from tests.sim import structures

TAYLOR = {
    "design": np.geomspace(1e-3, 1e-4, 4),
    "stiffness": np.geomspace(1e-4, 1e-5, 4),
    "contact": np.geomspace(1e-2, 1e-3, 4),
    "density": np.geomspace(1e-2, 1e-3, 4),
    "damping": np.geomspace(1e-2, 1e-3, 4),
    "drive": np.geomspace(1e-3, 1e-4, 4),
}
TAYLOR_IN_CONTACT = TAYLOR | {
    "design": np.geomspace(1e-4, 1e-5, 4),
    "stiffness": np.geomspace(4e-5, 4e-6, 4),
    "contact": np.geomspace(3e-3, 3e-4, 4),
    "density": np.geomspace(3e-3, 3e-4, 4),
    "damping": np.geomspace(3e-4, 3e-5, 4),
    "drive": np.geomspace(1e-4, 1e-5, 4),
}
DIFFERENCE, DIFFERENCE_IN_CONTACT = 1e-4, 1e-5
DURATION = 0.012
ASKED = np.linspace(0.0, DURATION, 9)
EVERYWHERE = np.linspace(0.0, DURATION, 301)

Method = Callable[[structures.Rig], Solver]
SOLVERS: dict[str, Method] = {
    "static": lambda rig: StaticSolver(rig.topology, np.array([0.4, 1.0]), relative=1e-13),
    "implicit": lambda rig: ImplicitSolver(
        rig.topology, np.linspace(0.0, DURATION, 61), ASKED, tolerance=1e-8
    ),
    "leapfrog": lambda rig: ExplicitSolver(rig.topology, DURATION, 400, ASKED, splitting=LEAPFROG),
    "blanes_moan": lambda rig: ExplicitSolver(
        rig.topology, DURATION, 300, ASKED, splitting=BLANES_MOAN
    ),
}
DYNAMIC = ("implicit", "leapfrog", "blanes_moan")
LOOPS = ("implicit", "blanes_moan")
"""One of each loop: the leapfrog is the same one with other coefficients."""
QUANTITIES = ("design", "stiffness", "density", "damping", "drive")


@cache
def recorded() -> structures.Rig:
    """The middle of the shaken squares, along a recorded wave."""
    return replace(structures.shaken(), motion=measured())


@cache
def pushed(slowly: bool) -> structures.Rig:
    """Squares clamped at corners, a force on one unit, which may not turn, and one on another."""
    course = (
        sim.LinearRamp(0.4, 1.0, 2.0) if slowly else sim.Harmonic(0.4, 150.0, 2.0, 0.0015, 0.003)
    )
    shares = np.array([[1.0], [-0.3]])
    control = np.array([[FORCE, FORCE, DISPLACEMENT], [FORCE] * 3])
    forces, driven = Superposition((course,), shares), np.array([12, 18])
    return structures.Rig(
        structures.rotating_squares(), structures.CORNERS, driven, forces, control=control
    )


@cache
def pulled() -> structures.Rig:
    """Polygons of all kinds, two of them pulled, each along a recorded path of its own."""
    driven = np.array([4, 7])
    return structures.Rig(structures.mixed_polygons(), np.array([0]), driven, measured(len(driven)))


def measured(n_units: int | None = None) -> sim.TimeSeries:
    """A recorded wave of 41 samples, of all driven units together or of each."""
    times = np.linspace(0.0, DURATION, 41)
    phase = np.arange(3 * (n_units or 1)).reshape(-1, 3)
    wave = np.sin(2 * np.pi * 150.0 * times[:, None, None] + phase) - np.sin(phase)
    motion = np.sin(np.pi * times / DURATION)[:, None, None] * wave * [1.0, 1.0, 0.05]
    return sim.TimeSeries(times, motion if n_units else motion[:, 0])


@cache
def solver_of(rig: structures.Rig, method: Method) -> Solver:
    return method(rig)


@cache
def gradient(rig: structures.Rig, method: Method) -> Floats:
    """Derivatives of the loss by all numbers, one after the other."""
    found = jax.grad(partial(rig.loss, solver_of(rig, method)))(rig.numbers)
    return np.asarray(ravel_pytree(found)[0])


@dataclass(frozen=True)
class Ray:
    """Loss of a solver along one direction, and its slope by the adjoint."""

    rig: structures.Rig
    method: Method
    quantity: str

    @property
    def solver(self) -> Solver:
        return solver_of(self.rig, self.method)

    @cached_property
    def direction(self) -> structures.Numbers:
        """A random change of one quantity alone."""
        rng = np.random.default_rng(7)
        recorded = isinstance(self.rig.motion, sim.TimeSeries)
        size = 0.1 if self.quantity == "drive" and recorded else 1.0

        def change(leaf: Floats) -> Floats:
            return np.asarray(size * rng.normal(size=leaf.shape) * (np.abs(leaf).max() or 1.0))

        changed = jax.tree.map(change, getattr(self.rig.numbers, self.quantity))
        if isinstance(changed, sim.TimeSeries):
            changed = changed._replace(times=np.zeros_like(changed.times))
        still = jax.tree.map(np.zeros_like, self.rig.numbers)
        return still._replace(**{self.quantity: changed})

    def at(self, step: float) -> structures.Numbers:
        return jax.tree.map(lambda x, d: x + step * d, self.rig.numbers, self.direction)

    def motion(self, step: float, solver: Solver) -> tuple[Floats, Floats]:
        """Displacement and velocity (1, n_times, n_units, 3), past JAX's tracing."""
        numbers = self.at(step)
        drive = self.rig.driven_by(numbers.drive)
        return solve_cases(solver, concrete(self.rig.parameters(numbers)), (drive,))[:2]

    def loss(self, step: float) -> float:
        return float(structures.uneven_loss(*self.motion(step, self.solver)))

    @property
    def slope(self) -> float:
        return float(gradient(self.rig, self.method) @ ravel_pytree(self.direction)[0])

    def order_of_remainder(self, steps: Floats) -> float:
        """Exponent with which the remainder of the linear model falls with the step."""
        start = self.loss(0.0)
        remainders = [abs(self.loss(h) - start - h * self.slope) for h in steps]
        return float(np.polyfit(np.log(steps), np.log(remainders), 1)[0])

    def difference(self, h: float) -> float:
        """Central difference of order four."""
        one = self.loss(h) - self.loss(-h)
        two = self.loss(2 * h) - self.loss(-2 * h)
        return (8 * one - two) / (12 * h)

    def in_contact(self, step: float, times: Floats) -> NDArray[np.bool_]:
        """Which ligaments are in contact when."""
        watching = replace(self.solver, output_times=times)  # type: ignore[type-var]
        void = np.asarray(self.rig.parameters(self.at(step)).void)
        motion = self.motion(step, watching)[0][0]
        return self.rig.topology.smallest_void_angles(void, motion) < CUTOFF


def assert_exact(ray: Ray) -> None:
    assert ray.slope == pytest.approx(ray.difference(DIFFERENCE), rel=1e-6)
    assert ray.order_of_remainder(TAYLOR[ray.quantity]) == pytest.approx(2.0, abs=0.05)


def assert_exact_in_contact(ray: Ray) -> None:
    assert ray.slope == pytest.approx(ray.difference(DIFFERENCE_IN_CONTACT), rel=1e-5)
    assert ray.order_of_remainder(TAYLOR_IN_CONTACT[ray.quantity]) == pytest.approx(2.0, abs=0.05)


Posed = Callable[[], structures.Rig]
Rows = list[tuple[Posed, tuple[str, ...], tuple[str, ...]]]
SMOOTH: Rows = [
    (partial(structures.squeezed, 4.0), ("static",), ("design", "stiffness", "drive")),
    (partial(pushed, slowly=True), ("static",), ("design", "stiffness", "drive")),
    (partial(pushed, slowly=False), LOOPS, QUANTITIES),
    (structures.shaken, DYNAMIC, ("design", "damping", "drive")),
    (recorded, DYNAMIC, ("drive",)),
    (pulled, LOOPS, ("design", "drive")),
]
TOUCHING: Rows = [
    (partial(structures.squeezed, 9.0), ("static",), ("design", "stiffness", "contact", "drive")),
    (partial(structures.shaken, bias_deg=45.0), LOOPS, (*QUANTITIES, "contact")),
]


def each(rows: Rows, *slow: Posed) -> pytest.MarkDecorator:
    cases = [
        pytest.param(rig, s, q, marks=[pytest.mark.slow] if rig in slow else [])
        for rig, solvers, quantities in rows
        for s in solvers
        for q in quantities
    ]
    return pytest.mark.parametrize(("posed", "solver", "quantity"), cases)


@each(SMOOTH, structures.shaken, recorded, pulled)
def test_gradients_without_contact(posed: Posed, solver: str, quantity: str) -> None:
    assert_exact(Ray(posed(), SOLVERS[solver], quantity))


@pytest.mark.slow
def test_equilibria_by_fronts() -> None:
    """30 x 30 squares, whose tangent is no longer stored as a band."""
    rig = structures.squeezed(20.0, side=30)
    assert rig.topology.numbering[1].storage == "fronts"
    assert_exact(Ray(rig, SOLVERS["static"], "design"))


@pytest.mark.parametrize("quantity", ["density", "damping"])
def test_equilibria_do_not_depend_on_inertia(quantity: str) -> None:
    rig = structures.squeezed(4.0)
    assert Ray(rig, SOLVERS["static"], quantity).slope == 0.0


@each(TOUCHING)
def test_gradients_in_contact(posed: Posed, solver: str, quantity: str) -> None:
    ray = Ray(posed(), SOLVERS[solver], quantity)
    times = ray.solver.output_times if solver == "static" else EVERYWHERE
    pattern = ray.in_contact(0.0, times)
    assert pattern.any()
    for step in TAYLOR_IN_CONTACT[quantity][0] * np.array([-1, 1]):
        np.testing.assert_array_equal(ray.in_contact(step, times), pattern)
    assert_exact_in_contact(ray)


@pytest.mark.parametrize("quantity", ["design", "contact", "drive"])
def test_motions_deep_in_contact(quantity: str) -> None:
    """Voids that close to their barrier, followed by many finer steps."""
    rig = structures.shaken(bias_deg=45.0, amplitude=3.0)
    ray = Ray(rig, SOLVERS["blanes_moan"], quantity)
    states = ray.motion(0.0, ray.solver)[0][0]
    assert rig.topology.smallest_void_angle(rig.values.void, states).min() < np.deg2rad(-13.5)
    assert ray.slope == pytest.approx(ray.difference(1e-7), rel=1e-3)


@pytest.mark.parametrize("solver", SOLVERS)
def test_sweeps_back_take_derivatives_of_any_library(solver: str) -> None:
    """Derivatives come as arrays of JAX, which are read only, or of NumPy."""
    rig = structures.shaken() if solver in DYNAMIC else structures.squeezed(4.0)
    method = solver_of(rig, SOLVERS[solver])
    by_jax = Ray(rig, SOLVERS[solver], "design").slope
    motion, velocity, records = solve_cases(method, rig.values, (rig.drive,))
    pulled = adjoint_cases(method, records, np.ones_like(motion), np.zeros_like(velocity))
    assert np.isfinite(by_jax)
    assert np.isfinite(pulled.parameters.law).all()
