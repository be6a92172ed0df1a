"""Maps designs to the parameters of their structures, and derivatives back."""

from collections.abc import Callable
from copy import copy
from functools import lru_cache, partial
from typing import Any, Self, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.core import Floats, Numbers
from sim.energy import parameters_at_rest
from sim.quasistatics import StaticSolver
from sim.scene.scene import Scene
from sim.solvers import LinearRamp, concrete, differentiable_motion
from sim.structure import ConcreteParameters, Parameters, parameters, parameters_at, shape

Passed: TypeAlias = float | Floats | tuple[Any, ...]
"""Types of a map's further arguments: numbers, arrays, and tuples of them."""


class ParameterMap:
    """Compiles a differentiable map (JAX) from designs to parameters, and its pull-back.

    What is ``passed`` stands behind the design vector.
    """

    def __init__(self, of_design: Callable[..., Parameters[Array]], *passed: Passed) -> None:
        self._of_design, self._passed = jax.jit(of_design), passed
        self._pull_back = jax.jit(
            lambda design, bar, *passed: jax.vjp(lambda x: of_design(x, *passed), design)[1](bar)[0]
        )

    def passing(self, *passed: Passed) -> Self:
        """Returns the map that passes something else, compiled no second time."""
        other = copy(self)
        other._passed = passed
        return other

    def __call__(self, design: Numbers) -> Parameters[Array]:
        """Parameters of a design vector (n_variables,); differentiable by it."""
        return self._of_design(design, *self._passed)

    def pull_back(self, design: Floats, bar: Parameters[Any]) -> Floats:
        """Pulls derivatives by the parameters back to those (n_variables,) by the design vector."""
        return np.asarray(self._pull_back(design, bar, *self._passed))


def rest_motion(scene: Scene, values: Parameters[Any]) -> Array:
    """Computes the motion (n_units, 3) to rest, the held units where they are; mm, mm, rad.

    It is differentiable by the parameters that a design of the scene changes.

    Raises:
        SimulationError: there is no equilibrium.
    """
    at_rest = scene.loads.following(LinearRamp(0.0, 1.0, 0.0))
    solver = StaticSolver(scene.topology, np.ones(1))
    return differentiable_motion(solver, values, (at_rest,), designed=True).displacement[0, 0]


class RestStateMap(ParameterMap):
    """Maps designs whose shims are bent to their parameters as they rest.

    The slots of the scene turn with the design; ``of_design`` gives the parameters before the shims
    turn the units.
    """

    def __init__(
        self, scene: Scene, of_design: Callable[..., Parameters[Array]], *passed: Floats
    ) -> None:
        super().__init__(of_design, *passed)
        self._scene = scene
        self._from_rest = jax.jit(partial(parameters_at_rest, scene.lattice))

    def __call__(self, design: Numbers) -> Parameters[Array]:
        """Parameters at rest of a design vector (n_variables,); differentiable by it.

        Raises:
            SimulationError: the structure does not come to rest.
        """
        values = super().__call__(design)
        return self._from_rest(values, rest_motion(self._scene, values))

    def pull_back(self, design: Floats, bar: Parameters[Any]) -> Floats:
        """See ``ParameterMap``."""
        return np.asarray(jax.vjp(self, jnp.asarray(design))[1](bar)[0])


@lru_cache(maxsize=16)
def parameters_of_design(scene: Scene) -> ParameterMap:
    """Compiles the map from a design vector to the parameters of its structure."""
    lattice, space, material = scene.lattice, scene.space, scene.structure.material

    def of_design(design: Array, shifts: Array, stiffness: Array) -> Parameters[Array]:
        made, built = shape(lattice, space.vertices(design) + shifts[lattice.group]), material
        if space.turning:
            angles = material.end_angles + space.end_angles(design)
            built = material._replace(end_angles=angles)
        return parameters(lattice, made, built.scaled(stiffness))

    as_designed = np.zeros((lattice.n_groups, 2)), np.ones((3, lattice.n_ligaments))
    if space.turning:
        return RestStateMap(scene, of_design, *as_designed)
    return ParameterMap(of_design, *as_designed)


def parameters_of_copies(scene: Scene) -> list[ParameterMap]:
    """Lists the maps to the parameters of a design's imperfect copies, or of itself alone."""
    of_design, copies = parameters_of_design(scene), scene.design.copies
    if copies is None:
        return [of_design]
    return [of_design.passing(*each) for each in zip(copies.shifts, copies.stiffness, strict=True)]


def concrete_parameters(scene: Scene, vertices: Floats) -> ConcreteParameters:
    """Computes the parameters of a structure as NumPy arrays."""
    return concrete(parameters_at(scene.lattice, vertices, scene.structure.material))
