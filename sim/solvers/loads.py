"""Prescribes motions of held units as functions of time.

A law computes in the library of the times that it is given: at once in NumPy, and in JAX where it
is differentiated.
"""

from typing import NamedTuple, Protocol

import numpy as np
from jax import Array

from sim.core import Floats, Ints, Numbers

DISPLACEMENT, FORCE, FREE = 0, 1, -1
"""Kinds of what a drive prescribes of a degree of freedom: a displacement or rotation, a
force or moment (a dead load), or nothing."""
NOTICED = 1e-3
"""Least kink of a series that steps stop at: how far its point lies off its neighbours' line, over
the series's range."""


class MotionLaw(Protocol):
    """Describes the motion (n_times, 3) of the driven units: ux, uy (mm), theta (rad).

    A law of one's own is a NamedTuple of its numbers, which NumPy and JAX can compute: a plain
    function hides them.
    """

    def __call__(self, times: Numbers) -> Numbers:
        """Computes the motion at the given times, s."""
        ...


def _along(direction: float | Array, displacement: Numbers) -> Numbers:
    """Returns displacement (n_times, 3) along a direction (rad), without rotation."""
    xp = displacement.__array_namespace__()
    still = xp.zeros_like(displacement)
    return xp.stack(
        [displacement * xp.cos(direction), displacement * xp.sin(direction), still], axis=-1
    )


class Turning(NamedTuple):
    """Turns by the history of a motion along x, its displacement in mm read as an angle in rad.

    Of a force, in N, it makes a moment, in N mm.
    """

    history: MotionLaw

    def __call__(self, times: Numbers) -> Numbers:
        """Computes the motion (n_times, 3) at the given times, s."""
        xp, along = times.__array_namespace__(), self.history(times)[:, 0]
        still = xp.zeros_like(along)
        return xp.stack([still, still, along], axis=-1)


class Harmonic(NamedTuple):
    """Moves along a direction by A sin(2 pi f t), from rest with a velocity jump (the authors').

    With a ``rise`` time the sine is switched on smoothly about ``delay``, and its phase starts
    there: A (1 + tanh((t - delay) / rise)) / 2 sin(2 pi f (t - delay)).

    Attributes:
        amplitude: A, mm.
        frequency: f, Hz.
        direction: against x, counter-clockwise, rad.
        rise, delay: s.
    """

    amplitude: float | Array
    frequency: float | Array
    direction: float | Array = 0.0
    rise: float | None = None
    delay: float = 0.0

    def __call__(self, times: Numbers) -> Numbers:
        """Computes the motion (n_times, 3) at the given times, s."""
        xp, shifted = times.__array_namespace__(), times - self.delay
        wave = self.amplitude * xp.sin(2 * xp.pi * self.frequency * shifted)
        if self.rise is not None:
            wave = wave * (1 + xp.tanh(shifted / self.rise)) / 2
        return _along(self.direction, wave)


class Pulse(NamedTuple):
    """Moves along a direction (rad) by A exp(-((t - delay) / width)^2), mm; times in s."""

    amplitude: float | Array
    width: float
    direction: float | Array = 0.0
    delay: float = 0.0

    def __call__(self, times: Numbers) -> Numbers:
        """Computes the motion (n_times, 3) at the given times, s."""
        xp, phase = times.__array_namespace__(), (times - self.delay) / self.width
        return _along(self.direction, self.amplitude * xp.exp(-(phase**2)))


class TanhRamp(NamedTuple):
    """Moves along a direction (rad) by A (1 + tanh(6 (2 t / T - 1))) / 2, mm; T in s."""

    amplitude: float | Array
    duration: float
    direction: float | Array = 0.0

    def __call__(self, times: Numbers) -> Numbers:
        """Computes the motion (n_times, 3) at the given times, s."""
        xp, phase = times.__array_namespace__(), 2 * times / self.duration - 1
        return _along(self.direction, self.amplitude * (1 + xp.tanh(6 * phase)) / 2)


class LinearRamp(NamedTuple):
    """Moves along a direction (rad) by A t / T, mm; T in s."""

    amplitude: float | Array
    duration: float
    direction: float | Array = 0.0

    def __call__(self, times: Numbers) -> Numbers:
        """Computes the motion (n_times, 3) at the given times, s."""
        return _along(self.direction, self.amplitude * times / self.duration)


class Superposition(NamedTuple):
    """Moves each driven unit by a sum of motions."""

    motions: tuple[MotionLaw, ...]  # (n_motions,) each of one history for all units
    shares: Floats | Array  # (n_units, n_motions) of each motion in that of each unit

    def __call__(self, times: Numbers) -> Numbers:
        """Computes the motion (n_times, n_units, 3) at the given times, s."""
        xp = times.__array_namespace__()
        each = xp.stack([motion(times) for motion in self.motions])
        return xp.einsum("um,mtd->tud", self.shares, each)


class TimeSeries(NamedTuple):
    """Follows a measured motion, interpolated linearly.

    A path of equilibria passes its peaks, though they lie between output loads; corners that are no
    peaks of a component are cut there.

    Attributes:
        times: (n,) s, ascending.
        motion: (n, 3) mm, mm, rad; or (n, n_units, 3) with one motion for each driven unit.
    """

    times: Numbers
    motion: Numbers

    def __call__(self, times: Numbers) -> Numbers:
        """Computes the motion (n_times, 3) or (n_times, n_units, 3) at the given times, s."""
        xp, flat = times.__array_namespace__(), self.motion.reshape(len(self.times), -1)
        columns = [xp.interp(times, self.times, flat[:, k]) for k in range(flat.shape[1])]
        return xp.stack(columns, axis=-1).reshape(len(times), *self.motion.shape[1:])


def breakpoints(motion: MotionLaw, end: float) -> Floats:
    """Finds the times (n,) up to ``end`` that no step may pass over, s: kinks, starts and ends.

    A bell or a switch, whose extent is infinite, counts as eight widths long.
    """
    match motion:
        case Superposition():
            found = np.concatenate([breakpoints(one, end) for one in motion.motions])
        case Turning():
            found = breakpoints(motion.history, end)
        case Pulse():
            found = motion.delay + motion.width * np.arange(-4.0, 5.0)
        case Harmonic(rise=float(rise)):
            found = motion.delay + rise * np.arange(-4.0, 5.0)
        case TimeSeries():
            found = _kinks(np.asarray(motion.times, dtype=float), np.asarray(motion.motion))
        case _:
            found = np.zeros(0)
    return np.unique(found[(found > 0.0) & (found < end)])


def _kinks(times: Floats, motion: Floats) -> Floats:
    """Times of the points that lie noticeably off the line through their neighbours."""
    flat = motion.reshape(len(times), -1)
    gaps = np.diff(times)[:, None]
    turned = np.abs(np.diff(np.diff(flat, axis=0) / gaps, axis=0))
    off = turned * gaps[1:] * gaps[:-1] / (gaps[1:] + gaps[:-1])
    noticed = np.ones(len(times), dtype=bool)
    noticed[1:-1] = (off > NOTICED * np.ptp(flat, axis=0)).any(axis=1)
    return np.asarray(times[noticed])


def series_times(motion: MotionLaw) -> Floats:
    """Lists the times (n,) of the points of all series in a motion, ascending, s."""
    series = (one for one in single_motions(motion) if isinstance(one, TimeSeries))
    return np.unique([time for one in series for time in np.asarray(one.times, dtype=float)])


def single_motions(motion: MotionLaw) -> tuple[MotionLaw, ...]:
    """Lists the motions that one is made of."""
    match motion:
        case Superposition():
            return tuple(one for each in motion.motions for one in single_motions(each))
        case Turning():
            return single_motions(motion.history)
        case _:
            return (motion,)


def held_dofs(clamped: Ints, driven: Ints) -> Ints:
    """Ids of all dofs of the clamped and driven units, ascending."""
    units = np.unique(np.concatenate([clamped, driven]))
    return (3 * units[:, None] + np.arange(3)).ravel()


def held_values(held: Ints, driven: Ints, motion: Numbers, control: Ints | None = None) -> Numbers:
    """Values (n_times, n_held) of the held dofs when ``driven`` follow a motion; the others rest.

    The loads come last in `held` (n_held,), three of each loaded unit. The motion is (n_times, 3)
    of all driven units, or (n_times, n_driven, 3); `control` (n_driven, 3) tells what each
    component is, by default a displacement.

    Raises:
        ValueError: a driven dof is not among the held ones, or a unit is driven twice.
    """
    return selected(held_selection(held, driven, control), motion)


def held_selection(held: Ints, driven: Ints, control: Ints | None = None) -> Floats:
    """Builds the selection (n_held, 3 n_driven) of held dofs by components of the driven units.

    Raises:
        ValueError: a driven dof is not among the held ones, or a unit is driven twice.
    """
    units = np.asarray(driven)
    if len(np.unique(units)) < len(units):
        raise ValueError("a driven unit is listed twice: its motions would add up")
    dofs = 3 * units[:, None] + np.arange(3)
    kinds = np.full(dofs.shape, DISPLACEMENT) if control is None else np.asarray(control)
    loaded = loaded_units(units, kinds)
    first = len(held) - 3 * len(loaded)
    place = np.searchsorted(held[:first], dofs)
    found = held[np.minimum(place, len(held) - 1)] == dofs
    if not found[kinds == DISPLACEMENT].all():
        raise ValueError("every dof of a driven unit must be held")
    load = first + 3 * np.searchsorted(loaded, units)[:, None] + np.arange(3)
    selection, acts = np.zeros((dofs.size, len(held))), (kinds != FREE).ravel()
    columns = np.where(kinds == FORCE, load, place).ravel()
    selection[np.flatnonzero(acts), columns[acts]] = 1.0
    return selection


def selected(selection: Numbers, motion: Numbers) -> Numbers:
    """Values (n_times, n_held) of the held dofs by their selection and a motion, as above."""
    if motion.ndim == 2:
        xp = motion.__array_namespace__()
        each = (len(motion), selection.shape[0] // 3, 3)
        motion = xp.broadcast_to(motion[:, None, :], each)
    return motion.reshape(len(motion), -1) @ selection


def loaded_units(units: Ints, control: Ints) -> Ints:
    """Finds the units (n_loaded,) under a force or a moment, ascending."""
    return np.unique(units[(control == FORCE).any(axis=1)])
