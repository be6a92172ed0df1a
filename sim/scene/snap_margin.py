"""Constrains designs to paths on which the structure does not snap."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse as sp

from sim.constraints import ConstraintVector
from sim.core import Floats, SimulationError
from sim.energy import system_of
from sim.quasistatics import StaticSolver, eigenvalue_and_slopes, lowest_eigenpair
from sim.scene.plan import Plan
from sim.scene.scene import Scene
from sim.scene.simulation import parameters_of_design
from sim.solvers import concrete, solve_cases
from sim.structure import Parameters


class SnapMargin:
    """Evaluates what a design must keep to, and that it leaves no load close to a snap.

    Below the geometric constraints there is one value for each load of each case,
    lambda / bound - 1 in mm, where lambda is the smallest eigenvalue of the tangent. The bound is
    ``scene.objective.snap_margin`` times that of the initial structure at rest. A structure that
    cannot be made is not loaded: its values are infinite.

    Args:
        scene: a static scene.
        plan: of `make_plan`.
        geometry: the other constraints.

    Raises:
        ValueError: the scene is not static, or has no snap margin.
        SimulationError: the initial structure is not stable at rest.
    """

    def __init__(self, scene: Scene, plan: Plan, geometry: ConstraintVector) -> None:
        share, solver = scene.objective.snap_margin, plan.solver
        if share is None or not isinstance(solver, StaticSolver):
            raise ValueError("a snap margin belongs to a static scene that asks for one")
        self.geometry, self._solver = geometry, solver
        self._cases = [scene.loads.cases[case] for case in plan.simulated]
        of_design = parameters_of_design(scene)
        self._parameters = of_design
        self._pull_back = jax.jit(lambda design, bar: jax.vjp(of_design, design)[1](bar)[0])
        initial = concrete(of_design(jnp.zeros(scene.space.n_variables)))
        system = system_of(scene.topology, initial)
        rest, _ = lowest_eigenpair(system, np.zeros(scene.topology.n_dofs))
        self.bound = share * rest

    def __call__(self, design: Floats) -> tuple[Floats, sp.csr_array]:
        """Evaluates the constraints (n_constraints,) and their Jacobian at a design vector, mm.

        Raises:
            SimulationError: the structure snaps, or cannot be simulated.
        """
        geometric, jacobian = self.geometry(design)
        if geometric.min(initial=0.0) < 0.0:
            count = len(self._cases) * len(self._solver.output_times)
            unknown, nothing = np.full(count, np.inf), sp.csr_array((count, len(design)))
            return np.append(geometric, unknown), sp.csr_array(sp.vstack([jacobian, nothing]))
        values, slopes = self._margins(design)
        return np.append(geometric, values), sp.csr_array(sp.vstack([jacobian, slopes]))

    def named(self, number: int) -> tuple[str, str]:
        """Names the kind of one of the values, and what it is about."""
        if number < self.geometry.n_constraints:
            return self.geometry.named(number)
        case, load = divmod(number - self.geometry.n_constraints, len(self._solver.output_times))
        return "snap", f"load {load + 1} of case {case}"

    def _margins(self, design: Floats) -> tuple[Floats, Floats]:
        """Margins (n,) of all loads in mm, and their derivatives (n, n_variables)."""
        values = concrete(self._parameters(jnp.asarray(design)))
        _, _, records = solve_cases(self._solver, values, self._cases)
        pull_back = partial(self._pull_back, design)
        found, rows = [], []
        for record in records.records:
            if record.jumped.any():
                load = np.nanmin(record.snapped) / self._solver.output_times[-1]
                raise SimulationError(f"the structure snaps at {load:.4g} of the load")
            for state in record.states:
                value, bar = eigenvalue_and_slopes(record.topology, values, state)
                found.append(value / self.bound - 1.0)
                rows.append(np.asarray(pull_back(Parameters(*bar))) / self.bound)
        return np.array(found), np.stack(rows)
