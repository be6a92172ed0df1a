"""Splits the record of a testing machine into branches, and measures loops and snaps."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pipeline.calibration.inputs import RecordOptions
from sim.core import Floats

REVERSAL = 0.2
"""Part of the whole range by which the displacement goes back where a branch ends."""
LEAST_RANGE = 0.5
"""Part of the whole range that a branch at least goes over: others are approaches to a start."""
PROMINENCE = 0.2
"""Height of a peak of the force over its whole range."""
SNAP_WIDTH = 0.2
"""Stroke of a snap over the branch's, at most."""
START = 0.05
"""Part of a branch's stroke over which its start is averaged."""
TOE_SIGMAS = 4.0
"""Standard deviations of the noise above which a toe is at least."""
LEAST_RESTING = 20
"""Readings from which the noise before contact is estimated, at least."""
MEDIAN_SIGMAS = 1.4826
"""Standard deviation over the median magnitude, of normal noise."""


class LoadBranch(NamedTuple):
    """Holds the loading or the unloading branch of a cycle."""

    loading: bool  # whether the displacement rises
    displacement: Floats  # (n,) in the order of time, mm
    force: Floats  # (n,) N

    @property
    def work(self) -> float:
        """Integrates the force over the displacement, N mm."""
        return float(np.trapezoid(self.force, self.displacement))

    def at(self, displacement: Floats) -> Floats:
        """Interpolates the force (n,); NaN outside of the branch."""
        order = np.argsort(self.displacement, kind="stable")
        known = self.displacement[order], self.force[order]
        return np.interp(displacement, *known, left=np.nan, right=np.nan)


class Snap(NamedTuple):
    """Holds where a force falls off suddenly: displacement in mm and force in N of both ends."""

    start: float
    peak: float
    end: float
    rest: float


def split_branches(displacement: Floats, force: Floats) -> list[LoadBranch]:
    """Splits a record where the displacement turns by a good part of its range.

    A shorter approach to the start, and a shorter way back at the end, are left out.
    """
    turns, reach = [0], REVERSAL * float(np.ptp(displacement))
    rising = None
    for k, here in enumerate(displacement):
        last = displacement[turns[-1]]
        if rising is None:
            if abs(here - last) > reach:
                rising = here > last
                stroke = displacement[: k + 1]
                turns = [int(stroke.argmin() if rising else stroke.argmax()), k]
        elif (here > last) == rising:
            turns[-1] = k
        elif abs(here - last) > reach:
            turns.append(k)
            rising = not rising
    parts = [
        (displacement[first : last + 1], force[first : last + 1]) for first, last in pairwise(turns)
    ]
    return [
        LoadBranch(bool(stroke[-1] > stroke[0]), stroke, load)
        for stroke, load in parts
        if len(stroke) > 1
    ]


def mean_branch(branches: Sequence[LoadBranch], points: int = 200) -> tuple[LoadBranch, Floats]:
    """Averages branches of one direction over the range that all have; and their scatter (n,).

    Raises:
        ValueError: there is none.
    """
    low = max(float(each.displacement.min()) for each in branches)
    high = min(float(each.displacement.max()) for each in branches)
    at = np.linspace(low, high, points)
    forces = np.array([each.at(at) for each in branches])
    scatter = forces.std(axis=0, ddof=1) if len(forces) > 1 else np.full(points, np.nan)
    return LoadBranch(branches[0].loading, at, forces.mean(axis=0)), scatter


def loop_areas(branches: Sequence[LoadBranch]) -> Floats:
    """Integrates the hysteresis loops (n_branches - 1,) of each branch and the next, N mm."""
    pairs = pairwise(branches)
    return np.array([abs(first.work + second.work) for first, second in pairs])


def find_snaps(branch: LoadBranch) -> list[Snap]:
    """Finds where the force's magnitude falls off suddenly, in the direction of the branch."""
    from scipy.signal import find_peaks

    turn = slice(None) if branch.loading else slice(None, None, -1)
    stroke, force = branch.displacement[turn], branch.force[turn]
    height = PROMINENCE * float(np.ptp(force))
    found = []
    for sign in (1.0, -1.0):
        peaks, _ = find_peaks(sign * force, prominence=height)
        turns, _ = find_peaks(-sign * force)
        for peak in peaks:
            fallen = (turns > peak) & (sign * (force[peak] - force[turns]) > height)
            end = turns[fallen][0] if fallen.any() else peak
            width = abs(stroke[end] - stroke[peak])
            if sign * force[peak] > 0 and 0 < width < SNAP_WIDTH * np.ptp(stroke):
                ends = stroke[peak], force[peak], stroke[end], force[end]
                found.append(Snap(*map(float, ends)))
    return found


def prepare_record(
    displacement: Floats, force: Floats, options: RecordOptions
) -> tuple[Floats, Floats]:
    """Selects branches of a record, and corrects them for the zero and the toe.

    Raises:
        ValueError: nothing is left.
    """
    turned = options.reversed
    stroke = -displacement if turned in ("displacement", "both") else displacement
    branches = split_branches(stroke, -force if turned in ("force", "both") else force)
    if options.drop_first:
        branches = branches[2:]
    branches = [
        each
        for each in branches
        if options.branch == "all" or each.loading == (options.branch == "loading")
    ]
    if not branches:
        raise ValueError("no such branch is in the record")
    parts = [_from_start(each, options) for each in branches]
    stroke, load = (np.concatenate(part) for part in zip(*parts, strict=True))
    return stroke, load


def _from_start(branch: LoadBranch, options: RecordOptions) -> tuple[Floats, Floats]:
    stroke, load = branch.displacement, branch.force
    turn = slice(None) if branch.loading else slice(None, None, -1)
    stroke, load = stroke[turn], load[turn]
    if options.zero == "start":
        first = stroke <= stroke.min() + START * np.ptp(stroke)
        stroke, load = stroke - stroke[first].mean(), load - load[first].mean()
    return (stroke, load) if options.toe is None else _from_contact(stroke, load, options.toe)


def _from_contact(stroke: Floats, load: Floats, toe: float) -> tuple[Floats, Floats]:
    """Counts the displacement from where the line between the toe and twice as much meets zero.

    Contact is after the last reading below the toe that comes before the first of twice as much.
    """
    if not (load >= 2 * toe).any():
        raise ValueError(f"the force does not rise to {2 * toe:g} N")
    doubled = int(np.argmax(load >= 2 * toe))
    below = np.flatnonzero(load[:doubled] < toe)
    if not len(below):
        raise ValueError(f"the force begins above {toe:g} N")
    first = int(below[-1]) + 1
    if (clear := TOE_SIGMAS * _noise(load[: max(first, LEAST_RESTING)])) > toe:
        raise ValueError(
            f"the toe of {toe:g} N is not clear of the force's noise before contact: give"
            f" {clear:.2g} N or more"
        )
    ends = [_crossing(stroke, load, k, level) for k, level in ((first, toe), (doubled, 2 * toe))]
    along = np.array([ends[0], *stroke[first:doubled], ends[1]])
    if along[-1] <= along[0]:
        raise ValueError(f"the force rises from {toe:g} N to {2 * toe:g} N without motion")
    slope, offset = np.polyfit(along, np.array([toe, *load[first:doubled], 2 * toe]), 1)
    return (stroke + offset / slope)[first:], load[first:]


def _noise(load: Floats) -> float:
    """Estimates the standard deviation of readings' noise about a smooth course."""
    bends = np.abs(np.diff(load, 2))
    return MEDIAN_SIGMAS * float(np.median(bends)) / 6**0.5 if len(bends) else 0.0


def _crossing(stroke: Floats, load: Floats, k: int, level: float) -> float:
    """Interpolates where the force passes a level between a reading and the one before."""
    part = (level - load[k - 1]) / (load[k] - load[k - 1])
    return float(stroke[k - 1] + part * (stroke[k] - stroke[k - 1]))
