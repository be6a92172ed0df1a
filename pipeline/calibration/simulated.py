"""Measurements that the simulator predicts, with the adjoint's derivatives of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pipeline.calibration.constants import Constants
from sim import dynamics
from sim.arrays import Floats, Ints, Numbers
from sim.dynamics import Drive, simulate
from sim.geometry import shape
from sim.implicit import ImplicitSolver
from sim.lattice import Lattice
from sim.loads import TimeSeries
from sim.model import Material, Parameters, Values, parameters
from sim.statics import StaticSolver

Seen = Callable[[Numbers, Parameters], Array]
"""What is measured of a motion (n_asked, n_units, 3) of given parameters."""


class KnownDrive(Drive):
    """A drive whose values are computed once: the fit asks for the same ones again and again."""

    def values(self, held: Ints, times: Floats) -> Floats:
        """See ``sim.dynamics.Drive``."""
        return self._once(super().values, held, times)

    def rates(self, held: Ints, times: Floats) -> Floats:
        """See ``sim.dynamics.Drive``."""
        return self._once(super().rates, held, times)

    def _once(self, compute: Callable[[Ints, Floats], Floats], held: Ints, times: Floats) -> Floats:
        memory = self.__dict__.setdefault("memory", {})
        key = (compute.__name__, held.tobytes(), times.tobytes())
        if key not in memory:
            memory[key] = compute(held, times)
        return memory[key]


@dataclass(frozen=True)
class Simulation:
    """A specimen on its measured drive.

    Attributes:
        lattice: its network.
        vertices: (n_vertices, 2) as built, mm.
        density: tonne/mm^2.
        contact: stiffness, N mm/rad^2.
        solver: of its motion.
        drive: of its held units.
        seen: what is measured of the motion.
    """

    lattice: Lattice
    vertices: Floats
    density: float
    contact: float
    solver: StaticSolver | ImplicitSolver
    drive: KnownDrive
    seen: Seen

    @cached_property
    def parameters(self) -> Callable[[Numbers], Parameters[Array]]:
        """Compiled map from a specimen's numbers (5,) to what the solvers take."""
        made = shape(self.lattice, self.vertices)

        @jax.jit
        def of_numbers(numbers: Numbers) -> Parameters[Array]:
            axial, shear, bending, translation, rotation = (numbers[k] for k in range(5))
            law = (axial, shear, bending, self.contact, translation, rotation)
            return parameters(self.lattice, made, Material(self.density, *law))

        return of_numbers

    @cached_property
    def _compiled(self) -> Seen:
        return jax.jit(self.seen)

    def predict(self, constants: Constants) -> Floats:
        """(n,) what is measured of a specimen.

        Raises:
            SimulationError: a step failed.
        """
        made = self.parameters(constants.numbers)
        values = Values(*(np.asarray(part) for part in made))
        motion, _, _ = dynamics.forward(self._solver(constants), values, (self.drive,))
        return np.asarray(self._compiled(motion[0], made))

    def pulled_back(self, constants: Constants, bar: Floats) -> tuple[Floats, Floats]:
        """Derivatives of `bar @ predict` by the numbers (5,) and by the drive's series, by adjoint.

        Raises:
            SimulationError: a step failed, or an equilibrium is not stable.
        """
        solver, units = self._solver(constants), self.drive.units
        series = self.drive.motion
        assert isinstance(series, TimeSeries)

        def weighted(numbers: Array, motion: Array) -> Array:
            made = self.parameters(numbers)
            drive = Drive(units, TimeSeries(series.times, motion))
            response = simulate(solver, made, (drive,))
            return self._compiled(response.displacement[0], made) @ bar

        at = jnp.asarray(constants.numbers), jnp.asarray(series.motion)
        by_numbers, by_motion = jax.grad(weighted, argnums=(0, 1))(*at)
        return np.asarray(by_numbers), np.asarray(by_motion)

    def _solver(self, constants: Constants) -> StaticSolver | ImplicitSolver:
        if constants.cutoff is None:
            return self.solver
        return replace(self.solver, topology=replace(self.solver.topology, cutoff=constants.cutoff))
