"""Spans a family of loads, and computes the loss under any of them with its derivatives.

Loads of all frequencies in an octave are solved on one grid, in time scaled by the ratio r of the
frequency to the octave's highest: r^2 M u'' + r C u' + f(u) = 0 is driven at that one. The
derivative by the frequency is then one by masses and dampings, exact for the steps taken.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from threading import Lock
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.core import Floats, Ints, Numbers
from sim.scene import DIRECTED, Scene, combined, concrete_parameters, make_plan, mimicking
from sim.solvers import Harmonic, MotionLaw, Solver, Together, differentiable_motion
from sim.structure import Parameters

Range = tuple[float, float]


@dataclass(frozen=True)
class LoadSetup:
    """Spans loads of one set-up of supports and drives, in ranges.

    A load is a place in the unit cube: its direction and amplitude grow linearly along the axes,
    its frequency by its logarithm. Of two motions at once the direction is that of their
    amplitudes: A cos of the first, A sin of the second.
    """

    motion: DIRECTED | Together  # the drive's
    direction: Range  # rad
    amplitude: Range  # mm
    frequency: Range | None = None  # Hz; None for a motion that has none
    scene: Scene | None = None  # whose loads these are; None for the one that is designed

    @property
    def size(self) -> int:
        """Counts the numbers of a load: direction, amplitude, and the frequency if it has one."""
        return 2 if self.frequency is None else 3

    @property
    def own_amplitude(self) -> float:
        """Amplitude of the drive's motion, mm."""
        return float(polar(self.motion)[1])

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

    def place(self, motion: DIRECTED | Together) -> Floats:
        """Finds the place (n,) of a motion, in the unit cube or not."""
        along = list(zip(polar(motion), (self.direction, self.amplitude), strict=True))
        if self.frequency is not None:
            assert isinstance(motion, Harmonic)
            low, high = self.frequency
            along.append((float(np.log(motion.frequency / low)), (0.0, float(np.log(high / low)))))
        return np.array(
            [(at - low) / (high - low) if high > low else 0.0 for at, (low, high) in along],
            dtype=float,
        )

    @property
    def varied(self) -> tuple[bool, ...]:
        """Tells which of the numbers of a load are in ranges, and not single values."""
        ranges = (self.direction, self.amplitude, self.frequency)
        return tuple(each[0] < each[1] for each in ranges if each is not None)

    def octave(self, place: Floats) -> int:
        """Counts the whole octaves from the highest frequency down to that of a place."""
        if self.frequency is None:
            return 0
        below = np.log2(self.frequency[1] / float(self.numbers(place)[2]))
        return int(np.floor(below + 1e-9))

    def fastest(self, octave: int) -> DIRECTED | Together:
        """Returns the largest motion with the highest frequency of an octave.

        What else has a duration keeps its number of periods.
        """
        largest = directed(self.motion, polar(self.motion)[0], self.amplitude[1])
        if self.frequency is None:
            return largest
        assert isinstance(largest, Harmonic)
        top = self.frequency[1] / 2.0**octave
        shorter = float(largest.frequency) / top
        rise = None if largest.rise is None else largest.rise * shorter
        return largest._replace(frequency=top, rise=rise, delay=largest.delay * shorter)

    def posed(self, scene: Scene) -> Scene:
        """Puts a scene, and its reference, under the supports and drives of the set-up.

        The region of interest is the set-up's too: what another drive moves is not to rest.
        """
        return scene if self.scene is None else _in_setup(scene, self.scene)


def _in_setup(scene: Scene, setup: Scene) -> Scene:
    """Takes loads and region from the scene of a set-up, for the reference as well."""
    own, other = scene.objective.reference, setup.objective.reference
    reference = _in_setup(own, other) if own and other else own
    made = replace(scene, loads=setup.loads)
    return made.updated(region=setup.objective.region, reference=reference)


@dataclass(frozen=True)
class LoadFamily:
    """Spans loads of one or several set-ups, alike in kind.

    Of several set-ups the last axis of the unit cube is cut into as many equal parts.
    """

    setups: tuple[LoadSetup, ...]  # the first that of the scene that is designed

    @property
    def size(self) -> int:
        """Counts the numbers of a load."""
        return self.setups[0].size + (len(self.setups) > 1)

    def number(self, places: Floats) -> Ints:
        """Numbers (...,) of the set-ups of places (..., n)."""
        count = len(self.setups)
        if count == 1:
            return np.zeros(places.shape[:-1], dtype=np.int64)
        return np.clip(places[..., -1] * count, 0, count - 1).astype(np.int64)

    def setup(self, place: Floats) -> LoadSetup:
        """Returns the set-up of a place (n,)."""
        return self.setups[int(self.number(place))]

    def numbers(self, places: Floats) -> Floats:
        """Direction (rad), amplitude (mm) and frequency (Hz) at places (..., n)."""
        each = np.stack([np.asarray(one.numbers(places)) for one in self.setups])
        return np.take_along_axis(each, self.number(places)[None, ..., None], axis=0)[0]

    def place(self, motion: DIRECTED | Together) -> Floats:
        """Finds the place (n,) of a motion of the first set-up, in the unit cube or not."""
        return self.centred(np.append(self.setups[0].place(motion), [0.0] * (len(self.setups) > 1)))

    def centred(self, places: Floats) -> Floats:
        """Moves places (..., n) to the one of equal loads that stands for them.

        It is in the middle of its set-up's part, and at the start of what is a single value.
        """
        numbers = self.number(places)
        varied = np.array([each.varied for each in self.setups])[numbers]
        inside = np.where(varied, places[..., : self.setups[0].size], 0.0)
        if len(self.setups) == 1:
            return inside
        middle = (numbers + 0.5) / len(self.setups)
        return np.concatenate([inside, middle[..., None]], axis=-1)


def directed(
    motion: DIRECTED | Together, direction: float | Array, amplitude: float | Array
) -> DIRECTED | Together:
    """Turns a motion along a direction (rad) with an amplitude (mm), or mixes two so."""
    if not isinstance(motion, Together):
        return motion._replace(direction=direction, amplitude=amplitude)
    parts = (amplitude * jnp.cos(direction), amplitude * jnp.sin(direction))
    mixed = zip(motion.motions, parts, strict=True)
    return motion._replace(motions=tuple(_one(one)._replace(amplitude=part) for one, part in mixed))


def polar(motion: DIRECTED | Together) -> tuple[float, float]:
    """Direction, rad, and amplitude, mm, of a motion or a mixture of two."""
    if not isinstance(motion, Together):
        return float(motion.direction), float(motion.amplitude)
    first, second = (float(_one(one).amplitude) for one in motion.motions)
    return float(np.arctan2(second, first)), float(np.hypot(first, second))


def _one(motion: MotionLaw) -> DIRECTED:
    assert isinstance(motion, DIRECTED)
    return motion


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


class _Posed(NamedTuple):
    """Holds a scene and its solver."""

    scene: Scene
    solver: Solver

    def displacement(self, values: Parameters[Any], motion: MotionLaw, ratio: Array) -> Array:
        """Displacement (1, n_times, n_units, 3), in time scaled by the ratio of frequencies."""
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
        self._posed = _Posed(posed, make_plan(posed, every_case=True).solver)
        self._intact: tuple[_Posed, Parameters[Any]] | None = None
        if (intact := posed.objective.reference) is not None:
            plan = make_plan(intact, intact.lattice.vertices, every_case=True)
            values = concrete_parameters(intact, intact.lattice.vertices)
            self._intact = _Posed(intact, plan.solver), values

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
