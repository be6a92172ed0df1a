"""Spans a family of loads, and computes the loss under any of them with its derivatives.

Loads of all frequencies in an octave are solved on one grid, in time scaled by the ratio r of the
frequency to the octave's highest: r^2 M u'' + r C u' + f(u) = 0 is driven at that one. The
derivative by the frequency is then one by masses and dampings, exact for the steps taken.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.core import Floats, Numbers
from sim.scene import DIRECTED, Scene, concrete_parameters, make_plan, mimicking
from sim.solvers import Harmonic, PrescribedMotion, Solver, differentiable_motion
from sim.structure import Parameters

Range = tuple[float, float]


@dataclass(frozen=True)
class LoadFamily:
    """Spans loads along directions, with amplitudes and frequencies in some ranges.

    A load is a place in the unit cube: its direction and amplitude grow linearly along the axes,
    its frequency by its logarithm. The loss of the motion's amplitude counts as it is, that of
    another one with the square of the ratio of the two.
    """

    motion: DIRECTED  # the drive's
    direction: Range  # rad
    amplitude: Range  # mm
    frequency: Range | None = None  # Hz; None for a motion that has none

    @property
    def size(self) -> int:
        """Counts the numbers of a load: direction, amplitude, and the frequency if it has one."""
        return 2 if self.frequency is None else 3

    def numbers(self, place: Numbers) -> Array:
        """Direction (rad), amplitude (mm) and frequency (Hz) at places (..., n)."""
        at = jnp.asarray(place)
        found = [
            low + (high - low) * at[..., axis]
            for axis, (low, high) in enumerate((self.direction, self.amplitude))
        ]
        if self.frequency is not None:
            low, high = self.frequency
            found.append(low * (high / low) ** at[..., 2])
        return jnp.stack(found, axis=-1)

    def place(self, motion: DIRECTED) -> Floats:
        """Finds the place (n,) of a motion, in the unit cube or not."""
        along = [(motion.direction, self.direction), (motion.amplitude, self.amplitude)]
        if self.frequency is not None:
            assert isinstance(motion, Harmonic)
            low, high = self.frequency
            along.append((float(np.log(motion.frequency / low)), (0.0, float(np.log(high / low)))))
        return np.array(
            [(at - low) / (high - low) if high > low else 0.0 for at, (low, high) in along],
            dtype=float,
        )

    def octave(self, place: Floats) -> int:
        """Counts the whole octaves from the highest frequency down to that of a place."""
        if self.frequency is None:
            return 0
        below = np.log2(self.frequency[1] / float(self.numbers(place)[2]))
        return int(np.floor(below + 1e-9))

    def fastest(self, octave: int) -> DIRECTED:
        """Returns the largest motion with the highest frequency of an octave.

        What else has a duration keeps its number of periods.
        """
        largest = self.motion._replace(amplitude=self.amplitude[1])
        if self.frequency is None:
            return largest
        assert isinstance(largest, Harmonic)
        top = self.frequency[1] / 2.0**octave
        shorter = float(largest.frequency) / top
        rise = None if largest.rise is None else largest.rise * shorter
        return largest._replace(frequency=top, rise=rise, delay=largest.delay * shorter)


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
        of_design: differentiable map of a design vector to parameters.
    """

    def __init__(
        self, scene: Scene, family: LoadFamily, of_design: Callable[[Array], Parameters[Any]]
    ) -> None:
        self._scene, self.family, self._of_design = scene, family, of_design
        self._octaves: dict[int, _Octave] = {}

    def __call__(self, design: Floats, place: Floats) -> LoadLoss:
        """Computes the loss of a design (n_variables,) under the load at a place, with derivatives.

        Raises:
            SimulationError: a step failed.
        """
        loss = jax.value_and_grad(self._octave(place).loss, argnums=(0, 1))
        value, (by_design, by_place) = loss(jnp.asarray(design), jnp.asarray(place))
        return LoadLoss(float(value), np.asarray(by_design), np.asarray(by_place))

    def value(self, design: Floats, place: Floats) -> float:
        """Computes the loss alone.

        Raises:
            SimulationError: a step failed.
        """
        return float(self._octave(place).loss(jnp.asarray(design), jnp.asarray(place)))

    def _octave(self, place: Floats) -> _Octave:
        number = self.family.octave(place)
        if number not in self._octaves:
            self._octaves[number] = _Octave(self._scene, self.family, number, self._of_design)
        return self._octaves[number]


class _Posed(NamedTuple):
    """Holds a scene and its solver."""

    scene: Scene
    solver: Solver

    def displacement(self, values: Parameters[Any], motion: DIRECTED, ratio: Array) -> Array:
        """Displacement (1, n_times, n_units, 3), in time scaled by the ratio of frequencies."""
        scaled = values._replace(mass=ratio**2 * values.mass, damping=ratio * values.damping)
        drive = PrescribedMotion(self.scene.loads.driven, motion)
        return differentiable_motion(self.solver, scaled, (drive,), designed=True).displacement


class _Octave:
    """Computes losses under the loads of an octave, all on one grid."""

    def __init__(
        self,
        scene: Scene,
        family: LoadFamily,
        number: int,
        of_design: Callable[[Array], Parameters[Any]],
    ) -> None:
        fastest, duration, top = family.fastest(number), scene.loads.duration, None
        if isinstance(fastest, Harmonic):
            assert isinstance(family.motion, Harmonic)
            top = float(fastest.frequency)
            duration *= float(family.motion.frequency) / top
        # explicit steps would have to be stable for the lowest frequency of the octave
        posed = scene.under((fastest,), duration, top, integrator="implicit")
        self._posed = _Posed(posed, make_plan(posed, every_case=True).solver)
        self._of_design = of_design
        self._intact: tuple[_Posed, Parameters[Any]] | None = None
        if (intact := posed.objective.reference) is not None:
            plan = make_plan(intact, intact.lattice.vertices, every_case=True)
            values = concrete_parameters(intact, intact.lattice.vertices)
            self._intact = _Posed(intact, plan.solver), values

        def load(place: Array) -> tuple[DIRECTED, Array]:
            direction, amplitude, *frequency = family.numbers(place)
            ratio = frequency[0] / top if frequency else jnp.ones(())
            return fastest._replace(direction=direction, amplitude=amplitude), ratio

        def relative(
            moved: Array, values: Parameters[Array], target: Array | None, amplitude: Array
        ) -> Array:
            loss = mimicking(posed, target)(moved, values)[0]
            # the error of a motion to mimic is relative to it already
            return loss if target is not None else loss * (family.motion.amplitude / amplitude) ** 2

        self._load, self._relative = jax.jit(load), jax.jit(relative)

    def loss(self, design: Array, place: Array) -> Array:
        """Computes the loss of a design under the load at a place; differentiable by both."""
        motion, ratio = self._load(place)
        values = self._of_design(design)
        moved, target = self._posed.displacement(values, motion, ratio), None
        if self._intact is not None:
            intact, constants = self._intact
            region = intact.scene.objective.region
            target = intact.displacement(constants, motion, ratio)[:, :, region]
        return self._relative(moved, values, target, motion.amplitude)
