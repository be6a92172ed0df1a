"""Simulates a specimen driven as it was: by the measured motion of the units that are held.

Each degree of freedom of each of these units is filtered by a smoothing spline (Dierckx 1975) that
departs from the track by its standard uncertainty, no more and no less: the sum of the squared
residuals over sigma is the number of frames. Its knots gather where the motion needs them, such as
at the start of a drive. Frames in which a unit was not seen are bridged by it.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import UnivariateSpline

from pipeline.posing import PosedStructure
from pipeline.runtime import UserError
from pipeline.tracking.output import distinct_frames
from sim.core import Floats, Ints, Mask, Numbers, SimulationError
from sim.energy import observe
from sim.scene import Scene, concrete_parameters, drive_force, simulate
from sim.solvers import PrescribedMotion

FINER = 2
"""Instants that the filtered motion is kept at, for every frame."""
LEAST_FRAMES = 8
"""Frames in which a unit must be seen to be followed."""


class HermiteMotion(NamedTuple):
    """Interpolates a motion by values and slopes at equal intervals; it rests before and after."""

    step: float  # between the instants, s; the first is at zero
    value: Numbers  # (n, n_units, 3) mm, mm, rad
    slope: Numbers  # (n, n_units, 3) per s

    def __call__(self, times: Numbers) -> Numbers:
        """Computes the motion (n_times, n_units, 3) at times in s: cubic between the instants."""
        xp, last = times.__array_namespace__(), len(self.value) - 1
        value, slope = xp.asarray(self.value), xp.asarray(self.slope)
        place = xp.clip(times / self.step, 0.0, last)
        before = xp.minimum(xp.floor(place), last - 1).astype(int)
        s = (place - before)[:, None, None]
        rise = value[before + 1] - value[before]
        bend = slope[before] * self.step - rise
        other = rise - slope[before + 1] * self.step
        return value[before] + s * rise + s * (1 - s) * ((1 - s) * bend + s * other)


class HeldMotion(NamedTuple):
    """Holds the filtered motion of the units that supports and drive hold."""

    unit: Ints  # (n,) places in the scene's lattice, ascending
    driven: Mask  # (n,) whether the unit follows the drive; the others are clamped
    motion: HermiteMotion  # (n_times, n, 3) of them all, as a function of the track's time
    noise: Floats  # (n, 3) root mean square of what the filter took out: mm, mm, rad
    filled: Floats  # (n,) part of the frames that were bridged
    # (n,) whether the unit was hardly ever seen: it then rests if it is clamped, and follows the
    # mean of the driven ones if it is driven
    assumed: Mask


class RedrivenMotion(NamedTuple):
    """Holds a simulation under the measured motion."""

    # (n_times, n_units, 3) of the units of the scene's lattice; NaN beyond the end of a path that
    # ended early
    displacement: Floats
    drive_force: Floats  # (n_times, 2) force of the drive on all its units, N
    failure: str | None = None  # why the path ended early


def filter_held_motion(track: xr.Dataset, scene: Scene) -> HeldMotion:
    """Filters the motion of the driven units and of those clamped in all three dofs.

    The displacement of the track is in the specimen's frame; its duplicate frames tell nothing.

    Raises:
        UserError: no driven unit was seen.
    """
    unit, driven = held_units(scene)
    seen = track.isel(time=distinct_frames(track)).sel(unit=scene.lattice.id[unit])
    measured, sigma = (
        seen[name].transpose("time", "unit", "dof").values.astype(float)
        for name in ("displacement", "sigma")
    )
    time = seen["time"].values - track["time"].values[0]
    observed = np.isfinite(measured).all(axis=2) & np.isfinite(sigma).all(axis=2)
    assumed = observed.sum(axis=0) < LEAST_FRAMES
    if assumed[driven].all():
        what = "no driven unit was seen, so the simulation cannot be driven as the specimen was"
        raise UserError(what, remedy="film it so that the units at the drive are in the picture")
    step = time[-1] / (FINER * (len(time) - 1))
    instants = step * np.arange(FINER * (len(time) - 1) + 1)
    value, slope = (np.zeros((len(instants), len(unit), 3)) for _ in range(2))
    noise = np.zeros((len(unit), 3))
    for place, dof in np.ndindex(noise.shape):
        if not assumed[place]:
            kept = observed[:, place]
            spline = fit_spline(time[kept], measured[kept, place, dof], sigma[kept, place, dof])
            value[:, place, dof] = spline(instants)
            slope[:, place, dof] = spline(instants, 1)
            rest = measured[kept, place, dof] - spline(time[kept])
            noise[place, dof] = np.sqrt(np.mean(rest**2))
    mean = driven & ~assumed
    for course in (value, slope):
        course[:, driven & assumed] = course[:, mean].mean(axis=1, keepdims=True)
    return HeldMotion(
        unit, driven, HermiteMotion(step, value, slope), noise, 1 - observed.mean(axis=0), assumed
    )


def held_units(scene: Scene) -> tuple[Ints, Mask]:
    """Finds the driven units and those clamped in all dofs, and marks which are driven."""
    clamped, count = np.unique(scene.loads.clamped // 3, return_counts=True)
    unit = np.union1d(clamped[count == 3], scene.loads.driven)
    return unit, np.isin(unit, scene.loads.driven)


def fit_spline(time: Floats, value: Floats, sigma: Floats) -> UnivariateSpline:
    """Fits the smoothing spline of a course (n,) with standard uncertainties (n,); n >= 8."""
    return UnivariateSpline(time, value, w=1 / sigma, s=len(time), ext="const")


def drive_as_measured(scene: Scene, held: HeldMotion) -> Scene:
    """Drives all held units of a scene as measured, up to the end of the measurement.

    What clamps them is left out, in place of which their measured motion stands.
    """
    return scene.updated(
        supports=tuple(
            replace(each, units=np.setdiff1d(each.units, held.unit))
            for each in scene.loads.supports
        ),
        cases=(PrescribedMotion(held.unit, held.motion),),
        weights=None,
        duration=held.motion.step * (len(held.motion.value) - 1),
        frequency=None,
        reference=None,
    )


def simulate_redriven(structure: PosedStructure, held: HeldMotion, times: Floats) -> RedrivenMotion:
    """Simulates the structure under the measured motion: in time, or as a path of equilibria.

    `times` (n_times,) are on the track's clock, ascending, s.
    """
    scene, vertices = structure
    driven = drive_as_measured(scene, held)
    shape = (len(times), scene.lattice.n_units, 3)
    displacement, force = np.full(shape, np.nan), np.full((len(times), 2), np.nan)
    failure = None
    try:
        found = simulate(driven, vertices=vertices, times=times).displacement[0]
    except SimulationError as error:
        failure = str(error)
        found = np.empty((0, *shape[1:])) if error.states is None else error.states
        found = found.reshape(-1, *shape[1:])
    if len(found):
        values = concrete_parameters(driven, vertices)
        seen = observe(driven.topology, values, found)
        displacement[: len(found)] = found
        drive, leading = driven.loads.cases[0], scene.loads.cases[0].leading
        force[: len(found)] = drive_force(driven, values, seen, drive, times[: len(found)], leading)
    return RedrivenMotion(displacement, force, failure)
