"""Tracks units from frame to frame: predicted, fitted, judged, and relocalised."""

import logging
from typing import NamedTuple

import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.detect import LatticePlace
from pipeline.tracking.fit import PoseFits
from pipeline.tracking.motion.light_slopes import LightSlopes
from pipeline.tracking.motion.prediction import latest_velocity
from pipeline.tracking.motion.unit_appearance import (
    HIDDEN,
    SHARE,
    STRAYED,
    ReferenceAppearance,
    white_share,
)
from pipeline.tracking.motion.unit_search import UnitSearch, UnitStates, gain_change
from sim.core import Floats, Ints, Mask, Reals

LOG = logging.getLogger(__name__)

_VELOCITY_FRAMES = 3
"""Frames before one that tell of its velocities."""
_JUMP_SHARE, _FOUND_SHARE = 0.9, 0.5
"""Part of the units below which the specimen may have jumped; with as many found in another place,
it has."""
_LOST_SHARE = 0.04
"""Part of the units, lost at once, from which it may have jumped too: by a whole number of pitches,
after which most units lie where others lay and are taken for these."""
_NEARLY_ALL = 0.8
"""Part of the units that must be found for their poses to be those looked for after a loss."""
_UNIT_TURNS = np.deg2rad([0, 15, -15, 30, -30])
"""Tried of every unit, beside the turn of a lattice that is found again; the first that fits. None
but the first unless nearly all are in view, since a lattice turned so may lie a unit aside."""
_TURN_DIFFERENCE = np.deg2rad(20.0)
"""Between turns at which a lattice may look alike."""
_MOST_TURN = np.deg2rad(45.0)
"""Within a frame of a specimen in sight: half of the turn that leaves squares as they were."""
_FACE_RADIUS = 0.5
"""Part of a unit's reach within which it shows its face alone."""


class TrackedFrame(NamedTuple):
    """Holds the outcome of a frame."""

    fits: PoseFits  # poses and what is known of them; NaN where not found
    quality: Ints  # (units,) GOOD or the reason


class _Trial(NamedTuple):
    """Holds what fits (units,) where a lattice may be, and whether these are most of its units."""

    place: LatticePlace
    fits: PoseFits
    good: Mask
    enough: bool


def _differ_in_turn(one: LatticePlace, other: LatticePlace) -> bool:
    return bool(np.abs(np.angle(np.exp(1j * (one.turn - other.turn)))) > _TURN_DIFFERENCE)


def _turn_between(pose: Floats, other: Floats) -> float:
    """Returns the angle between a lattice in some poses (units, 3) and in others, rad."""
    turns = np.exp(1j * (pose - other)[:, 2])
    return float(np.abs(np.angle(turns.mean())))


class Tracker:
    """Follows all units through frames given in sequence.

    Args:
        search: for the units in one frame; the first frame is its reference.
        slopes: of the light; without it, each frame tells its own.
        seen: (units,) which are not hidden in the first frame; others have no reference.

    Attributes:
        exposure: of a row, measured if it is not given.
    """

    def __init__(
        self, search: UnitSearch, slopes: LightSlopes | None = None, seen: Mask | None = None
    ) -> None:
        self._search, self._slopes = search, slopes
        self.exposure, self._relocaliser = search.exposure, search.relocaliser
        self._history: list[tuple[float, Floats]] = []
        self._out_of_sight, self._time = False, 0.0
        self._centre = search.fitter.templates.centre
        self._seen = np.ones(len(self._centre), bool) if seen is None else seen
        pose, photometry = search.fitter.start(1.0)
        self._known = UnitStates(pose, np.zeros_like(pose), photometry, np.zeros(len(pose)))
        self._last_complete = pose

    def step(self, image: Picture, time: float) -> TrackedFrame:
        """Finds the units in the next frame, at a time in s."""
        first = self._search.appearance is None
        interval, self._time = 0.0 if first else time - self._time, time
        known = self._known = self._known._replace(interval=interval)
        fits = self._search.fit(image, known, self._search.predicted(known), known.photometry)
        if not first:
            self._search.refit_missed(image, known, fits)
        if not first and self._search.allows_motion:
            known = self._known = self._with_velocity(fits.pose)
            if self.exposure.measuring:
                self._measure_exposure(image, fits)
            if self._search.shutter.readout or self.exposure.time:
                fits = self._search.fit(image, known, fits.pose, fits.photometry)
        if first:
            templates, noise = self._search.fitter.templates, self._search.shutter.noise
            self._search.appearance = ReferenceAppearance(fits, templates, noise, self._seen)
            self._search.fitter.full = np.nan_to_num(fits.information)
        good = self._search.complete(image, known, fits, self._search.accepted(fits, known))
        still = first or bool(good.mean() < _JUMP_SHARE)
        if not first and (still or self._loses_many(good)):
            fits, good = self._relocalise(image, fits, good)
            still |= self._known is not known  # a hand that passes stops no motion
        in_view = self._relocaliser.in_view(self._known.pose)
        if self._out_of_sight and good.sum() <= _FOUND_SHARE * in_view.sum():
            good[:] = False  # a few may be others, a unit aside
        good &= ~self._search.collisions(fits, good)
        quality = self._reasons(image, fits, good)
        if self._slopes is not None and not first:
            self._slopes.apply(fits, good)
        for values in fits:
            values[~good] = np.nan
        self._update(fits, good, still)
        return TrackedFrame(fits, quality)

    @property
    def bend_share(self) -> Reals:
        """Shares (units, 2) of accelerations that the blurred frame shows, as `ExposureBlur`."""
        return self._search.bend_share

    def _loses_many(self, good: Mask) -> bool:
        """Tests whether many units that the frame before shows are lost at once."""
        before = np.isfinite(self._history[-1][1][:, 0])
        return bool((before & ~good).sum() > _LOST_SHARE * len(good))

    def _measure_exposure(self, image: Picture, fits: PoseFits) -> None:
        known = self._known
        travel = np.linalg.norm(known.velocity[:, :2], axis=1) * known.interval
        there = self._search.accepted(fits, known, sharp=False)
        there &= np.isfinite([pose[:, 0] for _, pose in self._history]).all(axis=0)
        if len(self._history) < 2:
            return

        def residuals_of(chosen: Mask) -> Floats:
            """Residuals of units fitted again, in gains of the frame before."""
            again = self._search.fit(image, known, fits.pose, fits.photometry, chosen)
            return (again.noise / known.photometry[:, 0])[chosen]

        pixel = self._search.pixel
        self.exposure.measure(self._time, known.interval, travel, pixel, there, residuals_of)

    def _with_velocity(self, pose: Floats) -> UnitStates:
        """Computes the velocities at this frame from its poses and those before."""
        now = latest_velocity([*self._history, (self._time, pose)])
        return self._known._replace(velocity=np.where(np.isfinite(now), now, self._known.velocity))

    def _reasons(self, image: Picture, fits: PoseFits, good: Mask) -> Ints:
        """Classifies why units are missing, by what the frame shows at their last places."""
        assert self._search.appearance is not None, "the first frame is the reference"
        pose, lost, white = self._known.pose, np.flatnonzero(~good), np.zeros(len(good))
        middle = self._search.fitter.camera.project(self._centre[lost] + pose[lost, :2])
        reach = _FACE_RADIUS * self._search.fitter.templates.reach[lost] / self._search.pixel
        white[lost] = white_share(image, middle, reach)
        reasons = self._search.appearance.reasons(
            fits, good, self._relocaliser.in_view(pose), white
        )
        hidden = (reasons == HIDDEN) & self._seen
        if hidden.any():
            now = np.where(good[:, None], fits.pose, pose)
            reasons[hidden & self._relocaliser.near_unassigned(image, now, good)] = STRAYED
        return reasons

    def _relocalise(self, image: Picture, fits: PoseFits, good: Mask) -> tuple[PoseFits, Mask]:
        """Tries all units anew where the lattice is found; keeps what is more."""
        now = np.where(good[:, None], fits.pose, np.nan)
        places = self._relocaliser.find_lattice(image, self._last_complete, now)
        if not self._out_of_sight:  # from one frame to the next it turns by less than to look alike
            before = self._known.pose
            places = [place for place in places if _turn_between(place.pose, before) < _MOST_TURN]
        if not places:
            return fits, good
        most = self._relocaliser.in_view(places[0].pose).mean() > _NEARLY_ALL
        for own in _UNIT_TURNS if most else _UNIT_TURNS[:1]:
            tried = self._fit_places(image, fits, places, own)
            enough = [trial for trial in tried if trial.enough]
            if enough:
                break
        best = max(tried, key=lambda trial: trial.good.sum()) if not enough else enough[0]
        guessed = self._out_of_sight and not self._relocaliser.in_view(best.place.pose).all()
        # where the last place is turned otherwise, either may be another part of the lattice
        guessed = guessed and _turn_between(best.place.pose, tried[-1].place.pose) > _MOST_TURN
        if not guessed and (len(enough) < 2 or self._is_least_turn(best.place, enough[1].place)):
            there = self._known._replace(pose=best.place.pose)
            new = self._search.complete(image, there, best.fits, best.good)
            if new.sum() > good.sum():
                self._known = there
                return best.fits, new
        # where it was last, rows that come in may lie as other rows did
        return fits, good & (not self._out_of_sight)

    def _fit_places(
        self, image: Picture, fits: PoseFits, places: list[LatticePlace], own: float
    ) -> list[_Trial]:
        """Fits all units where the lattice may be, each turned by some angle of its own.

        All places are tried where nothing was seen before; else those turned least.
        """
        out: list[_Trial] = []
        for place in places:
            enough = [trial.place for trial in out if trial.enough]
            if enough and not self._out_of_sight and _differ_in_turn(enough[0], place):
                break
            again, none = fits.copy(), np.zeros(len(place.pose), bool)
            there = self._known._replace(pose=place.pose)
            trial = place.pose + np.array([0.0, 0.0, own]), there.photometry, None, SHARE
            good = self._search.try_missing(image, there, again, none, trial)
            most = _FOUND_SHARE * self._relocaliser.in_view(place.pose).sum()
            out.append(_Trial(place, again, good, bool(good.sum() > most)))
        return out

    def _is_least_turn(self, best: LatticePlace, other: LatticePlace) -> bool:
        """Tests whether one of two places that fit is right, for its turn is the lesser one.

        After a specimen was out of sight this is a guess, of which a warning tells, and none where
        it may be another part of the lattice that is in view.
        """
        if not _differ_in_turn(best, other):
            return False
        if self._out_of_sight:
            if not self._relocaliser.in_view(best.pose).all():
                return False
            LOG.warning(
                "nothing of the specimen was seen before %.4g s, and its lattice looks the"
                " same when it is turned: it is taken to be turned as little as may be",
                self._time,
            )
        return True

    def _update(self, fits: PoseFits, good: Mask, still: bool) -> None:
        known = self._known
        carried = self._search.neighbours.predict_rigid(known.pose, fits.pose, good, ~good)
        lost = np.where(np.isfinite(carried), carried, known.pose)
        pose = np.where(good[:, None], fits.pose, lost)
        moving = good[:, None] & (not still and known.interval > 0)
        velocity = np.where(moving, (pose - known.pose) / (known.interval or 1.0), 0.0)
        dimmed = known.photometry * gain_change(fits, known, good)
        photometry = np.where(good[:, None], fits.photometry, dimmed)
        relative = fits.noise / np.abs(fits.photometry[:, 0])
        usual = known.usual if still else np.where(good, relative, known.usual)
        self._out_of_sight = not good.any()
        seen = np.where(good[:, None], fits.pose, np.nan)
        self._history = [*self._history, (self._time, seen)][-_VELOCITY_FRAMES:]
        self._known = UnitStates(pose, velocity, photometry, usual)
        if good.mean() > _NEARLY_ALL:
            self._last_complete = pose
