"""Prescribes the motion of units, or the forces on them."""

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.core import Floats, Ints, Mask, Numbers
from sim.energy import Topology
from sim.solvers.loads import (
    DISPLACEMENT,
    FORCE,
    FREE,
    MotionLaw,
    Superposition,
    held_selection,
    loaded_units,
    selected,
    series_times,
)
from sim.structure import ConcreteParameters

PEAK = 1e-2
"""Part of the largest change up to which a peak of a series is noise."""


class PrescribedMotion(NamedTuple):
    """Prescribes the motion of units, or the forces on them; all other held dofs rest.

    Attributes:
        units: (n,) ids.
        motion: of them, mm, mm, rad; N, N, N mm where it is a force.
        control: (n, 3) whether each component is a DISPLACEMENT, a FORCE, or the dof is FREE; by
            default all dofs are displaced.
    """

    units: Ints
    motion: MotionLaw
    control: Ints | None = None

    @property
    def loaded(self) -> Ints:
        """(n_loaded,) units under a force, ascending."""
        return self.units[:0] if self.control is None else loaded_units(self.units, self.control)

    @property
    def leading(self) -> Ints:
        """(n_leading,) units whose force is the drive's: of motions together the first one's."""
        if not isinstance(self.motion, Superposition):
            return self.units
        return self.units[np.asarray(self.motion.shares)[:, 0] != 0.0]

    @property
    def displaces(self) -> Mask:
        """(2,) whether it displaces all its leading units along x and y."""
        if self.control is None:
            return np.ones(2, dtype=bool)
        leading = np.isin(self.units, self.leading)
        return np.asarray((self.control[leading, :2] == DISPLACEMENT).all(axis=0))

    def forces(self, times: Floats) -> Floats:
        """Forces (n_times, n, 3) that it puts on its units, N and N mm; zero where it puts none."""
        shape = (len(times), len(self.units), 3)
        if self.control is None:
            return np.zeros(shape)
        each = np.broadcast_to(self._at(times).reshape(len(times), -1, 3), shape)
        return np.where(self.control == FORCE, each, 0.0)

    def passed_peaks(self, times: Floats, arm: float) -> list[Floats]:
        """Finds where series go beyond what they are at two output times, between these.

        Args:
            times: (n_times,) of the outputs, s; the first comes after rest at zero.
            arm: by which rotations and moments compare with displacements and forces, mm.

        Returns:
            times of the largest and the smallest value of each component in the interval before
            each output, in the order in which they are passed; none that exceeds both ends by less
            than PEAK of the largest change of any component.
        """
        given = series_times(self.motion)
        if len(given) == 0:
            return [given] * len(times)
        at, ends = self._acting(given, arm), self._acting(np.append(0.0, times), arm)
        least, found = PEAK * self._largest_changes(at), []
        for k, (start, end) in enumerate(pairwise([0.0, *times.tolist()])):
            inner = (given > min(start, end)) & (given < max(start, end))
            inside, peaks = at[inner], np.zeros(0, dtype=np.int64)
            if inner.any():
                above = inside.max(axis=0) > ends[k : k + 2].max(axis=0) + least
                below = inside.min(axis=0) < ends[k : k + 2].min(axis=0) - least
                peaks = np.append(inside.argmax(axis=0)[above], inside.argmin(axis=0)[below])
            found.append(given[inner][np.unique(peaks)[:: 1 if end >= start else -1]])
        return found

    def _acting(self, times: Floats, arm: float) -> Floats:
        """Computes what acts (n_times, n, 3), rotations and moments in the others' units."""
        each = self._at(times).reshape(len(times), -1, 3)
        each = each if self.control is None else np.where(self.control == FREE, 0.0, each)
        forced = False if self.control is None else (self.control == FORCE)[..., 2]
        scales = np.ones(each.shape[1:])
        scales[:, 2] = np.where(forced, 1.0 / arm, arm)
        return np.asarray(each * scales)

    def _largest_changes(self, acting: Floats) -> Floats:
        """Measures the largest range of displacements, and of forces, for each component (n, 3)."""
        ranges = np.ptp(acting, axis=0)
        if self.control is None:
            return np.full_like(ranges, ranges.max())
        found = np.zeros_like(ranges)
        for kind in (DISPLACEMENT, FORCE):
            found[self.control == kind] = ranges[self.control == kind].max(initial=0.0)
        return found

    def resistance(self, values: ConcreteParameters, times: Floats) -> Floats:
        """Forces (n_times, n, 3) that accelerate and damp its units where it displaces them.

        They are in N and N mm. A `TimeSeries`, linear between its points, accelerates nothing.
        """
        rates, accelerations = (
            self._of_law(of, times).reshape(len(times), -1, 3)
            for of in (rates_of, accelerations_of)
        )
        found = values.damping[self.units] * rates + values.mass[self.units] * accelerations
        return found if self.control is None else np.where(self.control == DISPLACEMENT, found, 0.0)

    def values(self, held: Ints, times: Floats) -> Floats:
        """Computes the values (n_times, n_held) of the held dofs."""
        return self.on(held).values(times)

    def rates(self, held: Ints, times: Floats) -> Floats:
        """Returns their rates of change, per s."""
        return self.on(held).rates(times)

    def on(self, held: Ints) -> "SelectedMotion":
        """Selects the held dofs (n_held,) that it moves, for motions at many times."""
        return SelectedMotion(self, held_selection(held, self.units, self.control))

    def _at(self, times: Floats) -> Floats:
        """Computes the motion in NumPy, whichever arrays its numbers are."""
        plain = jax.tree.map(
            lambda leaf: np.asarray(leaf) if isinstance(leaf, Array) else leaf, self.motion
        )
        return np.asarray(plain(times))

    def start(self, topology: Topology, time: float) -> Floats:
        """Returns the state (n_dofs,) that a motion begins in: at rest, the held dofs in place."""
        state = np.zeros(topology.n_dofs)
        state[topology.held] = self.values(topology.held, np.array([time]))[0]
        return state

    def _of_law(self, of: Callable[..., Numbers], times: Floats) -> Floats:
        """Computes a derivative (n_times, ..., 3) of the motion."""
        # at a number of times that is a power of 2: JAX compiles for every new one
        padded = np.pad(times, (0, (1 << (len(times) - 1).bit_length()) - len(times)), mode="edge")
        return np.asarray(of(self.motion, padded))[: len(times)]


class SelectedMotion(NamedTuple):
    """Holds a drive beside the held dofs that it moves."""

    drive: PrescribedMotion
    selection: Floats  # (3 n, n_held) ones where a component is that of a held dof

    def values(self, times: Floats) -> Floats:
        """Computes the values (n_times, n_held) of the held dofs."""
        return np.asarray(selected(self.selection, self.drive._at(times)))

    def rates(self, times: Floats) -> Floats:
        """Returns their rates of change, per s."""
        return np.asarray(selected(self.selection, self.drive._of_law(rates_of, times)))


@jax.jit
def rates_of(motion: MotionLaw, times: Array) -> Numbers:
    """Differentiates a law by the time: rates (n_times, n, 3), per s."""
    return jax.jvp(motion, (times,), (jnp.ones_like(times),))[1]


@jax.jit
def accelerations_of(motion: MotionLaw, times: Array) -> Numbers:
    """Differentiates a law by the time twice: accelerations (n_times, n, 3), per s^2."""
    return jax.jvp(lambda at: rates_of(motion, at), (times,), (jnp.ones_like(times),))[1]
