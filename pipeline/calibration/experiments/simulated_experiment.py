"""Predicts measurements by the simulator, with the adjoint's derivatives of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pipeline.calibration.inputs import Constants
from sim.core import Floats, Numbers
from sim.quasistatics import StaticSolver
from sim.scene import GradientChain, ParameterMap
from sim.solvers import MotionLaw, PrescribedMotion, concrete, differentiable_motion, solve_cases
from sim.structure import (
    Lattice,
    LatticeArrays,
    Material,
    Parameters,
    Shape,
    arrays_of,
    parameters,
    shape,
)
from sim.time_integration import ImplicitSolver, time_grid

ExperimentSolver = StaticSolver | ImplicitSolver

Observation = Callable[[Numbers, Parameters], Array]
"""Readings of a motion (n_times, n_units, 3) of given parameters."""


def _parameters_of(
    numbers: Array,
    lattice: LatticeArrays,
    made: Shape,
    density: Numbers,
    contact: Numbers,
    stiffness_factors: Numbers,
) -> Parameters[Array]:
    """Derives the parameters of a specimen from its numbers (5,)."""
    axial, shear, bending, translation, rotation = (numbers[k] for k in range(5))
    stiffness = (
        stiffness_factors[:, 0] * axial,
        stiffness_factors[:, 1] * shear,
        stiffness_factors[:, 2] * bending,
    )
    return parameters(lattice, made, Material(density, *stiffness, contact, translation, rotation))


_PARAMETERS = ParameterMap(_parameters_of)
"""Compiles once for all specimens of a size: what tells them apart is passed."""


@dataclass(frozen=True)
class SpecimenSimulation:
    """Simulates a specimen on its measured drive."""

    lattice: Lattice  # its network
    vertices: Floats  # (n_vertices, 2) as built, mm
    density: float  # tonne/mm^2
    contact: float  # stiffness, N mm/rad^2
    solver: ExperimentSolver  # of its motion
    drive: PrescribedMotion  # of its held units
    observe: Observation  # computes the readings of a motion
    # (n_ligaments, 3) or (1, 3) factor on axial, shear and bending stiffness
    stiffness_factors: Floats = field(default_factory=lambda: np.ones((1, 3)))

    @cached_property
    def parameters(self) -> ParameterMap:
        """Maps a specimen's numbers (5,) to the solvers' parameters."""
        lattice, made = arrays_of(self.lattice), shape(self.lattice, self.vertices)
        return _PARAMETERS.passing(
            lattice, made, self.density, self.contact, self.stiffness_factors
        )

    @cached_property
    def _compiled(self) -> Observation:
        return jax.jit(self.observe)

    def predict(self, constants: Constants, drive: PrescribedMotion | None = None) -> Floats:
        """Predicts the readings (n,) of a specimen, under another drive if one is given.

        Raises:
            SimulationError: a step failed.
        """
        made = self.parameters(constants.numbers)
        cases = (drive or self.drive,)
        motion, _, _ = solve_cases(self._solver(constants), concrete(made), cases)
        return np.asarray(self._compiled(motion[0], made))

    def pull_back(
        self, constants: Constants, bar: Floats, drive: PrescribedMotion | None = None
    ) -> Floats:
        """Differentiates (5,) `bar @ predict` by the specimen's numbers, by the adjoint.

        Raises:
            SimulationError: a step failed, or an equilibrium is not stable.
        """
        return self._chain(
            np.asarray(constants.numbers),
            bar,
            solver=self._solver(constants),
            cases=(drive or self.drive,),
        )[1]

    def pull_back_to_drive(
        self, constants: Constants, bar: Floats, drive: PrescribedMotion | None = None
    ) -> MotionLaw:
        """Differentiates `bar @ predict` by the numbers of the drive's motion, by the adjoint.

        Raises:
            SimulationError: a step failed, or an equilibrium is not stable.
        """
        solver, made = self._solver(constants), self.parameters(constants.numbers)
        known = drive or self.drive

        def observe(motion: MotionLaw) -> Array:
            drives = (PrescribedMotion(known.units, motion),)
            return self.observe(differentiable_motion(solver, made, drives).displacement[0], made)

        return jax.vjp(observe, known.motion)[1](jnp.asarray(bar))[0]

    def finer(self) -> SpecimenSimulation:
        """Halves the steps in time; of equilibria there are none."""
        solver = self.solver
        if isinstance(solver, StaticSolver):
            return self
        return replace(self, solver=replace(solver, times=time_grid.halved(solver.times)))

    @cached_property
    def _chain(self) -> GradientChain:
        def weighted(motion: Array, made: Parameters[Array], bar: Array) -> tuple[Array, None]:
            return jnp.vdot(bar, self.observe(motion[0], made)), None

        return GradientChain(self.parameters, weighted)

    def _solver(self, constants: Constants) -> ExperimentSolver:
        if constants.cutoff is None:
            return self.solver
        topology = replace(self.solver.topology, contact=constants.law)
        return replace(self.solver, topology=topology)
