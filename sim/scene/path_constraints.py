"""Constrains designs under load: no snap on the path, no strain of foil beyond its limit."""

import logging
from collections.abc import Callable, Iterator
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse as sp
from jax import Array

from sim.constraints import ConstraintVector
from sim.core import Floats, Ints, SimulationError
from sim.energy import ligament_strain, system_of
from sim.optimise import Journal, feasible_design
from sim.quasistatics import (
    StaticRecord,
    StaticSolver,
    eigenvalue_and_slopes,
    lowest_eigenpair,
    softest_point,
)
from sim.scene.objectives import p_mean
from sim.scene.parameter_map import parameters_of_design
from sim.scene.plan import Plan
from sim.scene.scene import Scene
from sim.solvers import PrescribedMotion, Records, adjoint_cases, concrete, solve_cases
from sim.structure import ConcreteParameters, FoilLimit, Parameters, face_strains

LOG = logging.getLogger(__name__)

SHARPNESS = 64
"""p of the p-norm that stands for the largest strain: up to some 10 % above it."""

MONITORED = 12
"""Evaluations for which a load increment is monitored after a snap in it."""

Slope = tuple[float, ConcreteParameters]
"""A constraint value, and its derivatives by all parameters."""


START_SHARES = np.linspace(1.0, 0.1, 10)
"""Of a start that snaps, the larger ones first, that may serve in its place."""
START_STEP, START_ROUNDS = 1.0, 20
"""Largest change of a variable in a round that leads a start out of its snaps, mm; and rounds."""


def check_unsnapped(record: StaticRecord, load: float) -> None:
    """Checks that a path goes on without a snap up to the parameter of the full load.

    Raises:
        SimulationError: the structure snaps.
    """
    if record.jumped.any():
        share = np.nanmin(record.snapped) / load
        raise SimulationError(f"the structure snaps at {share:.4g} of the load path")


class PathConstraints:
    """Evaluates the constraints on a design, at rest and under its loads.

    Below the geometric constraints there is, in mm, with ``scene.objective.snap_margin``, one value
    for each load of the loss and each case: lambda / bound - 1 of the smallest eigenvalue lambda of
    the tangent at this load and at those passed on the way there (``Plan.confirming``), the bound
    being that margin times the eigenvalue of the initial structure at rest. Where a design snaps
    between two of them, lambda is for some evaluations that of the softest point there, negative
    within a fold: so a snap is a value to be raised like any other. With
    ``scene.objective.foil`` there is one value for each case: 1 - strain / limit of the largest
    strain of all ligaments and times, a p-norm in the place of the maximum.

    A structure that cannot be made is not loaded: its values are infinite. Values under loads are
    read back from a ``journal``, with their slopes, while it holds them.

    Raises:
        ValueError: a scene with a snap margin is not static.
        SimulationError: the initial structure is not stable at rest.
    """

    def __init__(
        self,
        scene: Scene,
        plan: Plan,
        geometry: ConstraintVector,
        journal: Journal | None = None,
    ) -> None:
        share, solver = scene.objective.snap_margin, plan.solver
        self.geometry, self._solver, self._foil = geometry, solver, scene.objective.foil
        self._path = solver
        if isinstance(solver, StaticSolver) and share is not None:
            # strains are those of the whole path, eigenvalues need none beyond a snap
            self._path = replace(plan.confirming, leaves=self._foil is not None)
            ends = solver.output_times
            self._load_of = np.searchsorted(ends, self._path.output_times * (1.0 - 1e-9))
        self._cases = [scene.loads.cases[case] for case in plan.simulated]
        self._numbers = plan.simulated
        self._of_design = parameters_of_design(scene)
        self.bound: float | None = None
        self._monitored: dict[tuple[int, int], int] = {}  # evaluations left for case and load
        if share is not None:
            if not isinstance(solver, StaticSolver):
                raise ValueError("a snap margin belongs to a static scene")
            initial = concrete(self._of_design(jnp.zeros(scene.space.n_variables)))
            system = system_of(scene.topology, initial)
            self.bound = share * lowest_eigenpair(system, np.zeros(scene.topology.n_dofs))[0]
        if self._foil is not None:
            self._strain = _strain_and_slopes(scene, self._foil)
        self._evaluate = self._solve if journal is None else journal.wrap(self._solve, self)

    def __call__(self, design: Floats) -> tuple[Floats, sp.csr_array]:
        """Evaluates the constraints (n_constraints,) and their Jacobian at a design vector, mm.

        Raises:
            SimulationError: the structure snaps where it must not, or cannot be simulated.
        """
        geometric, jacobian = self.geometry(design)
        if geometric.min(initial=0.0) < 0.0:
            count = self._n_snap + self._n_strain
            unknown, nothing = np.full(count, np.inf), sp.csr_array((count, len(design)))
            return np.append(geometric, unknown), sp.csr_array(sp.vstack([jacobian, nothing]))
        values, slopes = self._under_load(design)
        return np.append(geometric, values), sp.csr_array(sp.vstack([jacobian, slopes]))

    def recover_start(self, start: Floats) -> Floats:
        """Projects a start on the constraints, out of snaps; where that fails, shortens it first.

        Returns:
            the design vector (n_variables,), zero if none between it and the start serves.
        """
        for share in START_SHARES if start.any() else ():
            LOG.info("leading %.0f %% of the start out of its snaps, if any", 100 * share)
            found = feasible_design(self, share * start, START_STEP, START_ROUNDS)
            if found is not None:
                return found
            LOG.info("no design near it keeps to the constraints")
        return np.zeros_like(start)

    def named(self, number: int) -> tuple[str, str]:
        """Names the kind of one of the values, and what it is about."""
        if number < self.geometry.n_constraints:
            return self.geometry.named(number)
        after = number - self.geometry.n_constraints
        if after >= self._n_snap:
            return "shim_strain", f"case {self._numbers[after - self._n_snap]}"
        case, load = divmod(after, len(self._solver.output_times))
        return "snap", f"load {load + 1} of case {self._numbers[case]}"

    @property
    def _n_snap(self) -> int:
        return 0 if self.bound is None else len(self._cases) * len(self._solver.output_times)

    @property
    def _n_strain(self) -> int:
        return 0 if self._foil is None else len(self._cases)

    @property
    def state(self) -> Floats:
        """Lists monitored increments, which had a snap: case, load, evaluations left of each."""
        return np.array(
            [(*increment, left) for increment, left in self._monitored.items()], float
        ).ravel()

    @state.setter
    def state(self, monitored: Floats) -> None:
        rows = monitored.astype(int).reshape(-1, 3).tolist()
        self._monitored = {(case, load): left for case, load, left in rows}

    def _under_load(self, design: Floats) -> tuple[Floats, Floats]:
        """Evaluates values (n,) of all loads in mm, and their derivatives (n, n_variables)."""
        _, values, slopes = self._evaluate(design)
        return values, slopes

    def _solve(self, design: Floats) -> tuple[float, Floats, Floats]:
        """Computes values and derivatives in the form of an evaluation, whose loss is zero."""
        values = concrete(self._of_design(design))
        motion, _, records = solve_cases(self._path, values, self._cases)
        every = [
            *self._eigenvalue_constraints(values, records),
            *self._strain_constraints(values, motion, records),
        ]
        rows = [self._of_design.pull_back(design, Parameters(*bar)) for _, bar in every]
        return 0.0, np.array([value for value, _ in every]), np.stack(rows)

    def _eigenvalue_constraints(
        self, values: ConcreteParameters, records: Records
    ) -> Iterator[Slope]:
        if self.bound is None:
            return
        self._monitored = {
            increment: left - 1 for increment, left in self._monitored.items() if left > 1
        }
        for case, (drive, record) in enumerate(zip(self._cases, records.records, strict=True)):
            for jump in np.flatnonzero(record.jumped):
                self._monitored[case, int(jump)] = MONITORED
            for load in range(len(self._solver.output_times)):
                passed = np.flatnonzero(self._load_of == load)
                found = [
                    self._eigenvalue_between(values, drive, record, increment)
                    for increment in map(int, passed)
                    if (case, increment) in self._monitored
                ]
                at_loads = self._eigenvalue_at_loads(values, record, passed)
                value, bar = min([at_loads, *found], key=lambda slope: slope[0])
                yield value / self.bound - 1.0, Parameters(*(part / self.bound for part in bar))

    def _eigenvalue_at_loads(
        self, values: ConcreteParameters, record: StaticRecord, passed: Ints
    ) -> Slope:
        """Finds the smallest eigenvalue at some loads; infinite if the path ends before them."""
        reached = passed[np.isfinite(record.states[passed]).all(axis=1)]
        if not len(reached):
            return _no_eigenvalue(values)
        softest = reached[record.eigenvalue[reached].argmin()]
        topology = record.topology or self._solver.topology
        return eigenvalue_and_slopes(topology, values, record.states[softest])

    def _eigenvalue_between(
        self,
        values: ConcreteParameters,
        drive: PrescribedMotion,
        record: StaticRecord,
        increment: int,
    ) -> Slope:
        """Finds that of the softest point between a load and the one before; infinite if none."""
        before = (
            record.states[increment - 1] if increment else np.zeros_like(record.states[increment])
        )
        if not np.isfinite(before).all():
            return _no_eigenvalue(values)
        loads = np.append(0.0, self._path.output_times)
        begin, end = float(loads[increment]), float(loads[increment + 1])
        topology = record.topology or self._solver.topology
        found = softest_point(topology, values, drive, (begin, before), end)
        folds = found is not None and found.eigenvalue < 0.0
        if found is not None and folds:
            share, value = found.load / loads[-1], found.eigenvalue
            LOG.debug("a snap at %.3g of the path: smallest eigenvalue %.2g N/mm", share, value)
        if record.jumped[increment] and not folds:  # nothing leads out of this snap
            check_unsnapped(record, loads[-1])
        return _no_eigenvalue(values) if found is None else (found.eigenvalue, found.slopes)

    def _strain_constraints(
        self, values: ConcreteParameters, motion: Floats, records: Records
    ) -> Iterator[Slope]:
        if self._foil is None:
            return
        for drive, one, record in zip(self._cases, motion, records.records, strict=True):
            ratio, (bar_motion, direct) = self._strain(one, values)
            bar = np.asarray(bar_motion)[None]
            case_record = Records(values, [drive], [record])
            through = adjoint_cases(self._path, case_record, bar, np.zeros_like(bar)).parameters
            parts = (-one - other for one, other in zip(direct, through, strict=True))
            yield 1.0 - float(ratio), ConcreteParameters(*map(np.asarray, parts))


def _no_eigenvalue(values: ConcreteParameters) -> Slope:
    """Makes an infinite eigenvalue, of loads that a path does not reach."""
    return np.inf, ConcreteParameters(*(np.zeros_like(part) for part in values))


def _strain_and_slopes(
    scene: Scene, foil: FoilLimit
) -> Callable[..., tuple[Array, tuple[Array, Parameters[Array]]]]:
    """Compiles the largest strain over its limit, and its slopes by motion and parameters."""
    ends = scene.lattice.ligament_units

    def ratio(motion: Array, values: Parameters[Array]) -> Array:
        found = foil_strains(motion[:, ends], values, foil.thickness) / foil.strain
        largest = jax.lax.stop_gradient(jnp.abs(found).max())
        ratios = found.ravel()
        return p_mean(ratios, largest, jnp.ones_like(ratios), SHARPNESS)

    return jax.jit(jax.value_and_grad(ratio, argnums=(0, 1)))


def foil_strains(ends: Array, values: Parameters[Array], thickness: float) -> Array:
    """Computes the extreme strains (n_times, n_ligaments, 4) of ligaments of foil.

    The foil's thickness is in mm; `ends` (n_times, n_ligaments, 2, 3) are motions of the units at
    both ends, mm, mm, rad; the natural state of the parameters is that of straight foil.
    """
    of_all = jax.vmap(ligament_strain)

    def of_state(state: Array) -> Array:
        seen = of_all(state[:, 0], state[:, 1], values.arm[:, 0], values.arm[:, 1], values.vector)
        stretch, shear, bend = (
            part - rest for part, rest in zip(seen, values.natural.T, strict=True)
        )
        length, law = jnp.linalg.norm(values.vector, axis=1), (values.law[:, 1], values.law[:, 2])
        found = face_strains((stretch, shear, bend), law, length, thickness)
        return jnp.stack(found, axis=-1)

    return jax.vmap(of_state)(ends)
