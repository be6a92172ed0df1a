"""Lists scipy's ways to an equilibrium as methods, and the reference by one of them."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse.linalg as spla
from jax import Array
from scipy.optimize import NoConvergence, newton_krylov

from benchmarks.harness import Method, Run, Sample, Task, settings_of
from benchmarks.methods.jax_baseline import force
from benchmarks.scenes import LoadCase, case
from sim.core import Floats, Ints
from sim.energy import gradient, kinematics_of, system_of
from sim.scene import parameters_of_design
from sim.structure import VoidAngleContact
from sim.vibration import Linear, linearised

TIGHT = 1e-11
MAX_ITERATIONS, MAX_CUTS, PARTS = 12, 12, 10
GROWTH = 1.5
KRYLOV_ITERATIONS = 60


class EquilibriumProblem:
    """Evaluates forces on the free dofs of a case, and counts the evaluations."""

    def __init__(self, posed: LoadCase) -> None:
        scene = posed.scene
        self.topology, self.values = scene.topology, posed.values
        self.work = {"forces": 0, "factorisations": 0}
        self.free, self.held = np.sort(self.topology.free_dofs), self.topology.held
        self._system = system_of(self.topology, self.values)
        self._kinematics = kinematics_of(self._system)
        self._force = np.empty(self.topology.n_dofs)

    def residual(self, state: Floats) -> tuple[Floats, float]:
        """Computes the force on the free dofs (n_free,), and the largest reaction; N and N mm.

        Raises:
            ArithmeticError: a void is closed beyond its barrier.
        """
        self.work["forces"] += 1
        void = self.topology.smallest_void_angle(self.values.void, state.reshape(-1, 3))
        law = self.topology.contact
        if isinstance(law, VoidAngleContact) and void <= law.barrier_angle:
            raise ArithmeticError("units passed through each other")
        gradient(state, self._system, self._kinematics, self._force)
        return self._force[self.free], float(np.abs(self._force[self.held]).max())

    def tangent(self, state: Floats) -> tuple[Linear, spla.SuperLU]:
        """Linearises the structure and factorises its stiffness."""
        self.work["factorisations"] += 1
        made = linearised(self.topology, self.values, state.reshape(-1, 3))
        return made, spla.splu(made.stiffness)


def at_rest(name: str, tolerances: tuple[float, ...]) -> tuple[Method, ...]:
    """Lists Newton's method with SuperLU, and without a tangent; neither has a gradient."""
    return tuple(
        Method(method, partial(_prepare, name, solve), settings_of(tolerances), False, ("loss",))
        for method, solve in (("Newton, scipy splu", _newton), ("scipy newton_krylov", _krylov))
    )


def _prepare(name: str, method: Callable[..., Floats], tolerance: float, _: Task) -> Run:
    posed = case(name)
    rest, prepared = np.zeros(posed.scene.topology.n_dofs), EquilibriumProblem(posed)
    prepared.tangent(rest)
    prepared.residual(rest)
    posed.compile_measures()

    def run() -> Sample:
        balance = EquilibriumProblem(posed)
        motion = _follow_path(posed, partial(method, balance, tolerance))
        return Sample(posed.results(*posed.measured(motion, posed.values)), balance.work)

    return run


def _follow_path(posed: LoadCase, solve: partial[Floats]) -> Floats:
    """Follows the states (1, n_times, n_units, 3) along the loads; cuts increments that fail."""
    (drive,), top = posed.scene.loads.cases, posed.scene.topology
    held = drive.values(top.held, np.concatenate([[0.0], posed.times]))
    states = [np.zeros(top.n_dofs)]
    for before, after in pairwise(held):
        states.append(_follow_increment(states[-1], before, after, top.held, solve))
    return np.stack(states[1:]).reshape(1, len(posed.times), -1, 3)


def _follow_increment(
    state: Floats, before: Floats, after: Floats, held: Ints, solve: partial[Floats]
) -> Floats:
    reached, part, cuts = 0.0, 1.0, 0
    while reached < 1.0:
        part = min(part, 1.0 - reached)
        moved = np.zeros_like(state)
        moved[held] = part * (after - before)
        try:
            state = solve(state, moved)
        except (ArithmeticError, NoConvergence) as failed:
            cuts, part = cuts + 1, part / 2
            if cuts > MAX_CUTS:
                why = "no convergence" if isinstance(failed, NoConvergence) else failed
                raise ArithmeticError(f"gave up after {cuts} cut increments: {why}") from failed
            continue
        reached, part = reached + part, GROWTH * part
    return state


def _newton(balance: EquilibriumProblem, tolerance: float, state: Floats, moved: Floats) -> Floats:
    """Takes full Newton steps, the first along the path's tangent."""
    made, factor = balance.tangent(state)
    force_, _ = balance.residual(state)
    new = state + moved
    new[balance.free] -= factor.solve(force_ + made.coupling @ moved[balance.held])
    for _ in range(MAX_ITERATIONS):
        force_, reaction = balance.residual(new)
        if np.abs(force_).max() <= tolerance * max(reaction, 1e-3):
            return new
        new[balance.free] -= balance.tangent(new)[1].solve(force_)
    raise ArithmeticError("no convergence")


def _krylov(balance: EquilibriumProblem, tolerance: float, state: Floats, moved: Floats) -> Floats:
    """Solves without a tangent, from the last state with the held dofs moved on."""

    def unbalanced(free: Floats) -> Floats:
        new = state + moved
        new[balance.free] = free
        return balance.residual(new)[0].copy()

    reaction = max(balance.residual(state)[1], 1e-3)
    new = state + moved
    new[balance.free] = newton_krylov(
        unbalanced, state[balance.free], f_tol=tolerance * reaction, maxiter=KRYLOV_ITERATIONS
    )
    return new


def reference(name: str) -> Run:
    """Prepares states by Newton with SuperLU to 1e-11; the gradient by JAX on the law."""
    posed = case(name)
    balance = EquilibriumProblem(posed)
    of_design, forces = (
        parameters_of_design(posed.scene),
        jax.vmap(force(posed.scene), in_axes=(None, 0)),
    )

    def run() -> Sample:
        motion = _follow_path(posed, partial(_newton, balance, TIGHT))
        measured = jax.value_and_grad(lambda moved: posed.objective(moved, posed.values)[0])
        loss, bar = measured(jnp.asarray(motion))
        pulls = np.zeros_like(motion[0]).reshape(len(posed.times), -1)
        for pull, state, by_state in zip(
            pulls, motion[0], np.asarray(bar)[0].reshape(pulls.shape), strict=True
        ):
            factor = balance.tangent(state.ravel())[1]
            pull[balance.free] = factor.solve(by_state[balance.free])

        def lagrangian(design: Array) -> Array:
            values = of_design(design)
            balanced = forces(values, jnp.asarray(motion[0])).reshape(pulls.shape)
            return posed.objective(motion, values)[0] - jnp.vdot(pulls, balanced)

        gradient_ = jax.grad(lagrangian)(jnp.zeros(posed.scene.space.n_variables))
        return Sample(posed.results(loss, motion, gradient_), {})

    return run
