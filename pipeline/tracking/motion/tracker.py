"""Tracks units from frame to frame: predicted, fitted, judged, and relocalised."""

import logging
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.detect import LatticePlace, Relocaliser
from pipeline.tracking.fit import ExposureBlur, PoseFits, PoseFitter, SideWalls
from pipeline.tracking.geometry import SpecimenOutlines
from pipeline.tracking.motion.exposure_meter import ExposureMeter
from pipeline.tracking.motion.light_slopes import LightSlopes
from pipeline.tracking.motion.prediction import Neighbourhood, latest_velocity
from pipeline.tracking.motion.unit_looks import SHARE, SHARE_KNOWN, UnitLooks, white_share
from sim.core import Floats, Ints, Mask, Reals

LOG = logging.getLogger(__name__)

_QUICK = 2.0
"""Motion from frame to frame that may blur a unit where the exposure is not known, px."""
_PAST = 3
"""Frames before one that tell of its velocities."""
_STRAY = 0.25
"""A unit so far from where its neighbours carry it is another one, or none, pitches."""
_TURNED = 0.5
"""Or so far turned from there, rad."""
_TIGHT = 6.0
_FEW, _HALF = 0.9, 0.5
"""Part of the units below which the specimen may have jumped; with as many found in another place,
it has."""
_WHOLE = 0.8
"""Part of the units that must be found for their poses to be those looked for after a loss."""
_OWN_TURNS = np.deg2rad([0, 15, -15, 30, -30])
"""Tried of every unit, beside the turn of a lattice that is found again; the first that fits. None
but the first unless nearly all are in view, since a lattice turned so may lie a unit aside."""
_OTHER_TURN = np.deg2rad(20.0)
"""Between turns at which a lattice may look alike."""
_MOST_TURN = np.deg2rad(45.0)
"""Within a frame of a specimen in sight: half of the turn that leaves squares as they were."""
_CLOSE = 0.5
"""Two units nearer to each other than this part of their least distance at rest are one."""
_FACE = 0.5
"""Part of a unit's reach within which it shows its face alone."""
_ROUNDS = 40
_RETRIES = 4


class Shutter(NamedTuple):
    """Holds the shutter of a camera."""

    exposure: float | None = None  # of a row, s; without it, the first quick motions tell
    readout: float = 0.0  # from the first row to the last, s; negative where these are upside down
    noise: float = 0.0  # residuals to expect of the sensor's noise, levels


_GLOBAL = Shutter()


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


def _otherwise_turned(one: LatticePlace, other: LatticePlace) -> bool:
    return bool(np.abs(np.angle(np.exp(1j * (one.turn - other.turn)))) > _OTHER_TURN)


class Tracker:
    """Follows all units through frames given in sequence.

    Args:
        specimen: the units.
        fitter: the camera and the units' looks; the first frame is its reference.
        relocaliser: finds the lattice where prediction fails.
        walls: of thick units.
        shutter: of the camera.
        blur: by the exposure; without it, none is allowed for.
        slopes: of the light; without it, each frame tells its own.
        seen: (units,) which are not hidden in the first frame; others have no reference.

    Attributes:
        exposure: of a row, measured if it is not told.
    """

    def __init__(
        self,
        specimen: SpecimenOutlines,
        fitter: PoseFitter,
        relocaliser: Relocaliser,
        walls: SideWalls | None = None,
        shutter: Shutter = _GLOBAL,
        blur: ExposureBlur | None = None,
        slopes: LightSlopes | None = None,
        seen: Mask | None = None,
    ) -> None:
        self._fitter, self._relocaliser, self._walls = fitter, relocaliser, walls
        self._shutter, self._blur, self._slopes = shutter, blur, slopes
        self.exposure = ExposureMeter(shutter.exposure, fitter.templates.noise, blur is not None)
        self._past: list[tuple[float, Floats]] = []
        self._out_of_sight = False
        self._time, self._interval = 0.0, 0.0
        self._seen = np.ones(specimen.count, bool) if seen is None else seen
        self._looks: UnitLooks | None = None
        self._stray = _STRAY * specimen.pitch
        self._neighbours = Neighbourhood(specimen.centre)
        self._centre = specimen.centre
        middle = specimen.centre.mean(axis=0)
        self._pixel = 1 / float(fitter.camera.px_per_mm(middle))
        self._pose, self._photometry = fitter.start(1.0)
        self._whole = self._pose
        self._velocity = np.zeros_like(self._pose)
        self._usual = np.zeros(specimen.count)

    def step(self, image: Picture, time: float) -> TrackedFrame:
        """Finds the units in the next frame, at a time in s."""
        first = self._looks is None
        self._interval, self._time = 0.0 if first else time - self._time, time
        fits = self._fit(image, self._predicted(), self._photometry)
        if not first and (self._shutter.readout or self._blur is not None):
            self._improve_velocity(fits.pose)
            if self.exposure.open:
                self._measure_exposure(image, fits)
            if self._shutter.readout or self.exposure.time:
                fits = self._fit(image, fits.pose, fits.photometry)
        if first:
            self._looks = UnitLooks(fits, self._fitter.templates, self._shutter.noise, self._seen)
            self._fitter.full = np.nan_to_num(fits.information)
        good = self._complete(image, fits, self._accepted(fits, SHARE))
        jumped = good.mean() < _FEW
        if jumped and not first:
            fits, good = self._relocalise(image, fits, good)
        if self._out_of_sight and good.sum() <= _HALF * self._relocaliser.in_view(self._pose).sum():
            good[:] = False  # a few may be others, a unit aside
        good &= ~self._neighbours.collisions(fits.pose, good, _CLOSE)
        quality = self._reasons(image, fits, good)
        if self._slopes is not None and not first:
            self._slopes.apply(fits, good)
        for values in fits:
            values[~good] = np.nan
        self._update(fits, good, first or jumped)
        return TrackedFrame(fits, quality)

    def _fit(
        self,
        image: Picture,
        pose: Floats,
        photometry: Floats,
        chosen: Mask | None = None,
        tight: Floats | None = None,
    ) -> PoseFits:
        """Fits units as they move while the frame is exposed and read out."""
        rows = self._fitter.camera.size[1]
        drift = self._velocity * (self._shutter.readout / rows) if self._shutter.readout else None
        if self._blur is not None:
            way = self._velocity * self.exposure.time
            cos, sin = np.cos(self._pose[:, 2]), np.sin(self._pose[:, 2])
            x, y = way[:, 0], way[:, 1]
            own = np.stack([cos * x + sin * y, cos * y - sin * x, way[:, 2]], axis=1)
            self._blur.redraw(own, chosen)
        usual = self._usual if chosen is None else None
        return self._fitter.fit(image, pose, photometry, chosen, tight, usual, drift)

    @property
    def bend_share(self) -> Reals:
        """Shares (units, 2) of accelerations that the blurred frame shows, as `ExposureBlur`."""
        whole = np.ones((len(self._pose), 2), np.float16)
        return whole if self._blur is None else self._blur.share.copy()

    def _measure_exposure(self, image: Picture, fits: PoseFits) -> None:
        way = np.linalg.norm(self._velocity[:, :2], axis=1) * self._interval
        there = self._accepted(fits, SHARE, sharp=False)
        there &= np.isfinite([pose[:, 0] for _, pose in self._past]).all(axis=0)
        if len(self._past) < 2:
            return

        def left(chosen: Mask) -> Floats:
            """Residuals of units fitted again, in gains of the frame before."""
            again = self._fit(image, fits.pose, fits.photometry, chosen)
            return (again.noise / self._photometry[:, 0])[chosen]

        self.exposure.measure(self._time, self._interval, way, self._pixel, there, left)

    def _improve_velocity(self, pose: Floats) -> None:
        """Takes the velocities at this frame from the poses of it and of those before."""
        now = latest_velocity([*self._past, (self._time, pose)])
        self._velocity = np.where(np.isfinite(now), now, self._velocity)

    def _predicted(self) -> Floats:
        """Extrapolates the poses by their velocities, and redraws the walls there."""
        ahead = self._pose + self._velocity * self._interval
        if self._walls is not None:
            self._walls.redraw(ahead)
        return ahead

    @property
    def _known(self) -> UnitLooks:
        assert self._looks is not None, "the first frame is the reference"
        return self._looks

    def _accepted(self, fits: PoseFits, share: float, sharp: bool = True) -> Mask:
        """Judges fits; one that its motion may have blurred needs to be seen whole."""
        quick = None
        if sharp and not self.exposure.time and self._interval > 0:
            quick = np.linalg.norm((fits.pose - self._pose)[:, :2], axis=1) > _QUICK * self._pixel
        return self._known.accepted(fits, self._photometry, share, quick)

    def _reasons(self, image: Picture, fits: PoseFits, good: Mask) -> Ints:
        """Says why units are missing, by what the frame shows where they were last."""
        lost, white = np.flatnonzero(~good), np.zeros(len(good))
        middle = self._fitter.camera.project(self._centre[lost] + self._pose[lost, :2])
        reach = _FACE * self._fitter.templates.reach[lost] / self._pixel
        white[lost] = white_share(image, middle, reach)
        return self._known.reasons(fits, good, self._relocaliser.in_view(self._pose), white)

    def _complete(self, image: Picture, fits: PoseFits, good: Mask) -> Mask:
        """Looks for what is missing, where the good ones say."""
        if not good.any():
            return good
        return self._retry_hidden(image, fits, self._propagate(image, fits, good))

    def _relocalise(self, image: Picture, fits: PoseFits, good: Mask) -> tuple[PoseFits, Mask]:
        """Tries all units anew where the lattice is found; keeps what is more."""
        now = np.where(good[:, None], fits.pose, np.nan)
        places = self._relocaliser.placed_again(image, self._whole, now)
        if not self._out_of_sight:  # from one frame to the next it turns by less than to look alike
            places = [place for place in places if self._turned_since(place) < _MOST_TURN]
        if not places:
            return fits, good
        before = self._pose
        most = self._relocaliser.in_view(places[0].pose).mean() > _WHOLE
        for own in _OWN_TURNS if most else _OWN_TURNS[:1]:
            tried = self._tried(image, fits, places, own)
            enough = [trial for trial in tried if trial.enough]
            if enough:
                break
        best = max(tried, key=lambda trial: trial.good.sum()) if not enough else enough[0]
        guessed = self._out_of_sight and not self._relocaliser.in_view(best.place.pose).all()
        # turned otherwise it may be another part of the lattice
        guessed = guessed and self._turned_since(best.place) > _MOST_TURN
        if not guessed and (len(enough) < 2 or self._is_least_turn(best.place, enough[1].place)):
            self._pose = best.place.pose
            new = self._complete(image, best.fits, best.good)
            if new.sum() > good.sum():
                return best.fits, new
        self._pose = before
        # where it was last, rows that come in may lie as other rows did
        return fits, good & (not self._out_of_sight)

    def _turned_since(self, place: LatticePlace) -> float:
        """Returns the angle by which a lattice would have turned since the frame before, rad."""
        turns = np.exp(1j * (place.pose - self._pose)[:, 2])
        return float(np.abs(np.angle(turns.mean())))

    def _tried(
        self, image: Picture, fits: PoseFits, places: list[LatticePlace], own: float
    ) -> list[_Trial]:
        """Fits all units where the lattice may be, each turned by some angle of its own.

        All places are tried where nothing was seen before; else those turned least.
        """
        out: list[_Trial] = []
        for place in places:
            enough = [trial.place for trial in out if trial.enough]
            if enough and not self._out_of_sight and _otherwise_turned(enough[0], place):
                break
            again, none = fits.copy(), np.zeros(len(place.pose), bool)
            self._pose = place.pose
            guess = place.pose + np.array([0.0, 0.0, own])
            good = self._try(image, again, none, (guess, self._photometry, None, SHARE))
            there = self._relocaliser.in_view(place.pose).sum()
            out.append(_Trial(place, again, good, bool(good.sum() > _HALF * there)))
        return out

    def _is_least_turn(self, best: LatticePlace, other: LatticePlace) -> bool:
        """Tells whether one of two places that fit is right, for its turn is the lesser one.

        After a specimen was out of sight this is a guess, of which a warning tells, and none where
        it may be another part of the lattice that is in view.
        """
        if not _otherwise_turned(best, other):
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

    def _reachable(self, guess: Floats) -> Mask:
        """Tells guesses (units, 3) that are in view, if only in part."""
        return np.isfinite(guess[:, 0]) & self._relocaliser.in_view(guess, -_HALF)

    def _near(self, fits: PoseFits, guess: Floats) -> Mask:
        """Tells fits (units,) that ended near where they began, and so are no other unit's."""
        off = np.linalg.norm(fits.pose[:, :2] - guess[:, :2], axis=1)
        turned = np.abs(fits.pose[:, 2] - guess[:, 2])
        return np.asarray((off < self._stray) & (turned < _TURNED))

    def _propagate(self, image: Picture, fits: PoseFits, good: Mask) -> Mask:
        """Tries the units that were not found where their neighbours would have carried them."""
        for _ in range(_ROUNDS):
            good &= ~self._neighbours.outliers(fits.pose, good, self._stray)
            guess = self._neighbours.predict_rigid(self._pose, fits.pose, good, ~good)
            wanted = self._reachable(guess)
            if not wanted.any():
                break
            photometry = self._photometry * self._gain_change(fits, good)
            again = self._fit(image, guess, photometry, wanted)
            new = self._accepted(again, SHARE) & wanted & self._near(again, guess)
            if not new.any():
                break
            fits.take(again, new)
            good |= new
        return good

    def _retry_hidden(self, image: Picture, fits: PoseFits, good: Mask) -> Mask:
        """Tries those again that may be hidden in part: place and brightness are known."""
        photometry = self._photometry * self._gain_change(fits, good)
        tight = _TIGHT * self._known.noise * np.abs(photometry[:, 0])
        for _ in range(_RETRIES):
            if good.all():
                break
            before = int(good.sum())
            for guess in self._hidden_poses(fits, good):
                for least, scale in ((SHARE, None), (SHARE_KNOWN, tight)):
                    good = self._try(image, fits, good, (guess, photometry, scale, least))
            if good.sum() == before:
                break
        return good

    def _try(
        self,
        image: Picture,
        fits: PoseFits,
        good: Mask,
        trial: tuple[Floats, Floats, Floats | None, float],
    ) -> Mask:
        """Fits what is not good from a guess and keeps what is accepted and has not strayed."""
        guess, photometry, tight, least = trial
        wanted = ~good & self._reachable(guess)
        if not wanted.any():
            return good
        again = self._fit(image, guess, photometry, wanted, tight)
        new = self._accepted(again, least) & wanted & self._near(again, guess)
        both = fits.copy()
        both.take(again, new)
        new &= ~self._neighbours.outliers(both.pose, good | new, self._stray)
        fits.take(again, new)
        return good | new

    def _hidden_poses(self, fits: PoseFits, good: Mask) -> Iterator[Floats]:
        """Guesses poses of hidden units: carried on, or stretched with those that are seen.

        Units of these lattices turn with or against their neighbours, so both are tried.
        """
        carried = self._neighbours.predict_rigid(self._pose, fits.pose, good, ~good)
        ahead = self._predicted()
        yield np.where(np.isfinite(carried), carried, ahead)
        yield ahead
        place = self._neighbours.predict_affine(fits.pose, good, ~good)
        turn = self._neighbours.rotation_size(fits.pose, good, ~good)
        for angle in (turn, -turn, np.zeros_like(turn)):
            yield np.column_stack([place, angle])

    def _gain_change(self, fits: PoseFits, good: Mask) -> float:
        """Measures how much brighter the frame is than the one before."""
        if not good.any():
            return 1.0
        return float(np.median(fits.photometry[good, 0] / self._photometry[good, 0]))

    def _update(self, fits: PoseFits, good: Mask, still: bool) -> None:
        carried = self._neighbours.predict_rigid(self._pose, fits.pose, good, ~good)
        lost = np.where(np.isfinite(carried), carried, self._pose)
        pose = np.where(good[:, None], fits.pose, lost)
        moving = good[:, None] & (not still and self._interval > 0)
        self._velocity = np.where(moving, (pose - self._pose) / (self._interval or 1.0), 0.0)
        self._photometry = np.where(
            good[:, None], fits.photometry, self._photometry * self._gain_change(fits, good)
        )
        relative = fits.noise / np.abs(fits.photometry[:, 0])
        if not still:
            self._usual = np.where(good, relative, self._usual)
        self._out_of_sight = not good.any()
        seen = np.where(good[:, None], fits.pose, np.nan)
        self._past = [*self._past, (self._time, seen)][-_PAST:]
        self._pose = pose
        if good.mean() > _WHOLE:
            self._whole = pose
