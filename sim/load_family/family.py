"""Spans a family of loads: directions, amplitudes and frequencies of one or several set-ups."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.core import Floats, Ints, Numbers
from sim.scene import DIRECTED, Scene
from sim.solvers import Harmonic, MotionLaw, Superposition

Range = tuple[float, float]


@dataclass(frozen=True)
class LoadSetup:
    """Spans loads of one set-up of supports and drives, in ranges.

    A load is a place in the unit cube: its direction and amplitude grow linearly along the axes,
    its frequency by its logarithm. Of two motions at once the direction is that of their
    amplitudes: A cos of the first, A sin of the second.
    """

    motion: DIRECTED | Superposition  # the drive's
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
        """Computes direction (rad), amplitude (mm) and frequency (Hz) at places (..., n)."""
        at = jnp.asarray(place)
        found = [
            low + (high - low) * at[..., axis]
            for axis, (low, high) in enumerate((self.direction, self.amplitude))
        ]
        if self.frequency is not None:
            low, high = self.frequency
            found.append(low * (high / low) ** at[..., 2])
        return jnp.stack(found, axis=-1)

    def place(self, motion: DIRECTED | Superposition) -> Floats:
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
        """Marks the numbers of a load that are in ranges, and not single values."""
        ranges = (self.direction, self.amplitude, self.frequency)
        return tuple(each[0] < each[1] for each in ranges if each is not None)

    def octave(self, place: Floats) -> int:
        """Counts the whole octaves from the highest frequency down to that of a place."""
        if self.frequency is None:
            return 0
        below = np.log2(self.frequency[1] / float(self.numbers(place)[2]))
        return int(np.floor(below + 1e-9))

    def fastest(self, octave: int) -> DIRECTED | Superposition:
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
        return scene if self.scene is None else _with_setup(scene, self.scene)


def _with_setup(scene: Scene, setup: Scene) -> Scene:
    """Takes loads and region from the scene of a set-up, for the reference as well."""
    own, other = scene.objective.reference, setup.objective.reference
    reference = _with_setup(own, other) if own and other else own
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
        """Computes direction (rad), amplitude (mm) and frequency (Hz) at places (..., n)."""
        each = np.stack([np.asarray(one.numbers(places)) for one in self.setups])
        return np.take_along_axis(each, self.number(places)[None, ..., None], axis=0)[0]

    def place(self, motion: DIRECTED | Superposition) -> Floats:
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
    motion: DIRECTED | Superposition, direction: float | Array, amplitude: float | Array
) -> DIRECTED | Superposition:
    """Turns a motion along a direction (rad) with an amplitude (mm), or mixes two so."""
    if not isinstance(motion, Superposition):
        return motion._replace(direction=direction, amplitude=amplitude)
    parts = (amplitude * jnp.cos(direction), amplitude * jnp.sin(direction))
    mixed = zip(motion.motions, parts, strict=True)
    return motion._replace(
        motions=tuple(_single_motion(one)._replace(amplitude=part) for one, part in mixed)
    )


def polar(motion: DIRECTED | Superposition) -> tuple[float, float]:
    """Returns direction, rad, and amplitude, mm, of a motion or a mixture of two."""
    if not isinstance(motion, Superposition):
        return float(motion.direction), float(motion.amplitude)
    first, second = (float(_single_motion(one).amplitude) for one in motion.motions)
    return float(np.arctan2(second, first)), float(np.hypot(first, second))


def _single_motion(motion: MotionLaw) -> DIRECTED:
    assert isinstance(motion, DIRECTED)
    return motion
