"""Computes the loss under any load of a family, with its derivatives.

Loads of all frequencies in an octave are solved on one grid, in time scaled by the ratio r of the
frequency to the octave's highest: r^2 M u'' + r C u' + f(u) = 0 is driven at that one. The
derivative by the frequency is then one by masses and dampings, exact for the steps taken.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from threading import Lock
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.core import Floats
from sim.load_family.family import LoadFamily, LoadSetup, directed
from sim.scene import Scene, combined, concrete_parameters, make_plan, mimicking
from sim.solvers import Harmonic, MotionLaw, Solver, differentiable_motion
from sim.structure import Parameters


class LoadLoss(NamedTuple):
    """Holds the loss under a load, and its derivatives."""

    value: float  # the loss, relative to the size of the load
    by_design: Floats  # (n_variables,) per mm
    by_place: Floats  # (n,) along the axes of the unit cube


class LoadLosses:
    """Computes the losses of designs under the loads of a family.

    Args:
        scene: what the loads act on; its horizon is of as many periods for each of them.
        family: the loads.
        of_design: differentiable map of a design vector to parameters; several of imperfect copies,
            the p-mean of whose losses counts then.
    """

    def __init__(
        self, scene: Scene, family: LoadFamily, *of_design: Callable[[Array], Parameters[Any]]
    ) -> None:
        self._scene, self.family, self._of_designs = scene, family, of_design
        self._octaves: dict[tuple[int, int], _Octave] = {}
        self._making = Lock()

    def __call__(self, design: Floats, place: Floats) -> LoadLoss:
        """Computes the loss of a design (n_variables,) under the load at a place, with derivatives.

        Raises:
            SimulationError: a step failed.
        """
        loss = jax.value_and_grad(self._loss(place), argnums=(0, 1))
        value, (by_design, by_place) = loss(jnp.asarray(design), jnp.asarray(place))
        return LoadLoss(float(value), np.asarray(by_design), np.asarray(by_place))

    def value(self, design: Floats, place: Floats) -> float:
        """Computes the loss alone.

        Raises:
            SimulationError: a step failed.
        """
        return float(self._loss(place)(jnp.asarray(design), jnp.asarray(place)))

    def _loss(self, place: Floats) -> Callable[[Array, Array], Array]:
        octave, copies = self._octave(place), self._of_designs
        if len(copies) == 1:
            return partial(octave.loss, copies[0])
        shares = np.full(len(copies), 1 / len(copies))
        sharpness = self._scene.objective.copy_sharpness

        def mean(design: Array, place: Array) -> Array:
            each = jnp.stack([octave.loss(copy, design, place) for copy in copies])
            return combined(each, shares, sharpness)

        return mean

    def _octave(self, place: Floats) -> _Octave:
        setup = self.family.setup(place)
        key = int(self.family.number(place)), setup.octave(place)
        with self._making:  # losses are asked for from several threads, and an octave takes long
            if key not in self._octaves:
                own = self.family.setups[0].own_amplitude
                self._octaves[key] = _Octave(self._scene, setup, key[1], own)
            return self._octaves[key]


class _PosedScene(NamedTuple):
    """Holds a scene and its solver."""

    scene: Scene
    solver: Solver

    def displacement(self, values: Parameters[Any], motion: MotionLaw, ratio: Array) -> Array:
        """Computes displacements (1, n_times, n_units, 3), in time scaled by a frequency ratio."""
        scaled = values._replace(mass=ratio**2 * values.mass, damping=ratio * values.damping)
        drive = self.scene.loads.following(motion)
        return differentiable_motion(self.solver, scaled, (drive,), designed=True).displacement


class _Octave:
    """Computes losses under the loads of an octave, all on one grid."""

    def __init__(
        self,
        scene: Scene,
        setup: LoadSetup,
        number: int,
        own_amplitude: float,
    ) -> None:
        if scene.objective.reaction > 0.0:
            raise ValueError("over loads in ranges motions alone are mimicked, not forces")
        scene = setup.posed(scene)
        fastest, duration, top = setup.fastest(number), scene.loads.duration, None
        if isinstance(fastest, Harmonic):
            assert isinstance(setup.motion, Harmonic)
            top = float(fastest.frequency)
            duration *= float(setup.motion.frequency) / top
        # explicit steps would have to be stable for the lowest frequency of the octave
        posed = scene.under((fastest,), duration, top, integrator="implicit")
        self._posed = _PosedScene(posed, make_plan(posed, every_case=True).solver)
        self._intact: tuple[_PosedScene, Parameters[Any]] | None = None
        if (intact := posed.objective.reference) is not None:
            plan = make_plan(intact, intact.lattice.vertices, every_case=True)
            values = concrete_parameters(intact, intact.lattice.vertices)
            self._intact = _PosedScene(intact, plan.solver), values

        def load(place: Array) -> tuple[MotionLaw, Array, Array]:
            direction, amplitude, *frequency = setup.numbers(place)
            ratio = frequency[0] / top if frequency else jnp.ones(())
            return directed(fastest, direction, amplitude), amplitude, ratio

        def relative(
            moved: Array, values: Parameters[Array], target: Array | None, amplitude: Array
        ) -> Array:
            loss = mimicking(posed, target)(moved, values)[0]
            # the error of a motion to mimic is relative to it already
            return loss if target is not None else loss * (own_amplitude / amplitude) ** 2

        self._load, self._relative = jax.jit(load), jax.jit(relative)

    def loss(
        self, of_design: Callable[[Array], Parameters[Any]], design: Array, place: Array
    ) -> Array:
        """Computes the loss of a design under the load at a place; differentiable by both."""
        motion, amplitude, ratio = self._load(place)
        values = of_design(design)
        moved, target = self._posed.displacement(values, motion, ratio), None
        if self._intact is not None:
            intact, constants = self._intact
            region = intact.scene.objective.region
            target = intact.displacement(constants, motion, ratio)[:, :, region]
        return self._relative(moved, values, target, amplitude)
