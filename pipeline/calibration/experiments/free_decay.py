"""Measures the free decay of two units on one ligament: an angle over time."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pipeline.calibration.experiments.experiment import LEAST_LINES, MeasuredValues
from pipeline.calibration.inputs import ConstantName, Constants, FreeDecay
from pipeline.problem.fields import csv_columns, units
from pipeline.runtime import UserError
from sim.core import Floats
from sim.structure import unrotated_inertia

LEAST_DISTANCE = 0.75
"""Peaks are at least so many periods apart."""
VISIBLE_PEAK = 0.1
"""Peaks below this part of the highest are left out."""
LEAST_PEAKS = 4
SAMPLES = 32
"""Least number of samples of a trace."""


class DecayPeaks(NamedTuple):
    """Holds the decay by a line through the logarithms of peaks."""

    ratio: float  # damping ratio
    error: float  # its standard error
    frequency: float  # of the damped oscillation, rad/s


def read(asked: FreeDecay, folder: Path) -> tuple[Floats, Floats]:
    """Reads times in s, from zero, and angles in rad from the file of a set.

    Raises:
        UserError: the file cannot be used.
    """
    assert asked.file is not None
    path = folder / asked.file
    wanted = {asked.columns.time: units.TIME, asked.columns.angle: units.ANGLE}
    time, angle = csv_columns.read_quantities(path, wanted, LEAST_LINES).T
    key, remedy = asked.columns.time, "sort the lines by time, each time once"
    if (np.diff(time) <= 0).any():
        line = int(np.argmax(np.diff(time) <= 0)) + 2
        what = f"the clock does not ascend at the {line}th line of numbers"
        raise UserError(what, file=path, key=key, value=float(time[line - 1]), remedy=remedy)
    if len(time) < SAMPLES:
        remedy = f"give {SAMPLES} lines or more"
        raise UserError(f"only {len(time)} samples", file=path, remedy=remedy)
    if fit_peaks(time - time[0], angle) is None:
        remedy = "cut the trace to begin after the release, with several periods above the noise"
        raise UserError("no decaying oscillation is seen", file=path, remedy=remedy)
    return time - time[0], angle


def fit_peaks(time: Floats, angle: Floats) -> DecayPeaks | None:
    """Computes the damping ratio by the authors' method: the slope of the logarithms of peaks.

    A trend is taken off first. With the slope m and the frequency w of the damped oscillation, the
    ratio is 1 / sqrt(1 + (w / m)^2). The logarithms are weighted by the peaks' heights, since noise
    moves those of low ones more. None where there are too few peaks, or they do not decay.
    """
    from scipy.signal import detrend, find_peaks

    even = np.linspace(time[0], time[-1], len(time))
    course = detrend(np.interp(even, time, angle))
    spectrum = np.abs(np.fft.rfft(course * np.hanning(len(course))))
    period = len(course) / max(int(spectrum.argmax()), 1)
    place, _ = find_peaks(course, distance=max(LEAST_DISTANCE * period, 1.0))
    place = place[course[place] > VISIBLE_PEAK * course.max()]
    if len(place) < LEAST_PEAKS:
        return None
    left, top, right = course[place - 1], course[place], course[place + 1]
    bend = left - 2 * top + right
    offset = np.where(bend < 0, (left - right) / np.where(bend < 0, 2 * bend, 1.0), 0.0)
    at = np.interp(place + offset, np.arange(len(even)), even)
    height = top - (left - right) * offset / 4
    frequency = 2 * np.pi * (len(at) - 1) / float(at[-1] - at[0])
    (slope, _), scatter = np.polyfit(at, np.log(height), 1, w=height, cov=True)
    if slope >= 0:
        return None
    ratio = 1 / np.sqrt(1 + (frequency / slope) ** 2)
    error = ratio * (1 - ratio**2) * np.sqrt(scatter[0, 0]) / -slope
    return DecayPeaks(float(ratio), float(error), frequency)


@dataclass(frozen=True)
class DecayTest:
    """Holds a trace (``experiment.Experiment``).

    Its own unknowns are offset (rad), drift (rad/s), the amplitudes of cosine and sine (rad), and
    the logarithm of the undamped frequency (rad/s).
    """

    measured: MeasuredValues
    peaks: DecayPeaks
    depends_on: tuple[ConstantName, ...] = (
        "damping_ratio",
        "damping_rotation",
        "bending_stiffness",
    )

    def frequency_ratio(self, constants: Constants) -> float:
        """Divides the frequency of the trace by that of the law that tells its damping ratio."""
        undamped = self.peaks.frequency / np.sqrt(1 - self.peaks.ratio**2)
        return float(undamped / hinge_frequency(constants))

    @property
    def nuisance_start(self) -> Floats:
        """Fits offset, drift and amplitudes at the peaks' frequency and damping."""
        frequency = self.peaks.frequency / np.sqrt(1 - self.peaks.ratio**2)
        shapes = decay_terms(self.measured.abscissa, self.peaks.ratio, frequency)
        return np.append(np.linalg.lstsq(shapes, self.measured.values)[0], np.log(frequency))

    @property
    def nuisance_scale(self) -> Floats:
        """See ``experiment.Experiment``."""
        size, whole = np.ptp(self.measured.values), np.ptp(self.measured.abscissa)
        return np.array([size, size / whole, size, size, 1 / (self.peaks.frequency * whole)])

    def predict(self, constants: Constants, nuisance: Floats) -> Floats:
        """Predicts angles, see ``experiment.Experiment``."""
        shapes = decay_terms(self.measured.abscissa, constants.ratio, float(np.exp(nuisance[-1])))
        return np.asarray(shapes @ nuisance[:-1])


def hinge_frequency(constants: Constants) -> float:
    """Computes the undamped frequency (rad/s) of one unit on one ligament, by the authors' law."""
    _, inertia = unrotated_inertia(constants.material.density, constants.spacing)
    return float(np.sqrt(constants.material.bending_stiffness / inertia))


def decay_terms(time: Floats, ratio: float, frequency: float) -> Floats:
    """Computes the terms (n, 4) of a trace (n,): 1, t, and a decaying cosine and sine."""
    envelope, phase = np.exp(-ratio * frequency * time), frequency * np.sqrt(1 - ratio**2) * time
    oscillation = [envelope * np.cos(phase), envelope * np.sin(phase)]
    return np.stack([np.ones_like(time), time, *oscillation], axis=1)


def pose_decay(asked: FreeDecay, time: Floats, angle: Floats) -> DecayTest:
    """Returns the set as an experiment."""
    sigma = np.full(len(angle), 1.0 if asked.noise is None else asked.noise)
    measured = MeasuredValues(asked.name, asked.kind, time, angle, sigma, asked.noise is not None)
    peaks = fit_peaks(time, angle)
    assert peaks is not None
    return DecayTest(measured, peaks)
