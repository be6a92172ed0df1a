"""Searches the units in one frame: fits from guesses, accepts, predicts by neighbours."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.detect import Relocaliser
from pipeline.tracking.fit import CoarseLevel, ExposureBlur, PoseFits, PoseFitter, SideWalls
from pipeline.tracking.geometry import SpecimenOutlines
from pipeline.tracking.motion.exposure_meter import ExposureMeter
from pipeline.tracking.motion.prediction import Neighbourhood
from pipeline.tracking.motion.unit_appearance import SHARE, SHARE_KNOWN, ReferenceAppearance
from sim.core import Floats, Mask, Reals

_QUICK = 2.0
"""Motion from frame to frame that may blur a unit where the exposure is not known, px."""
_STRAY = 0.25
"""A unit so far from where its neighbours carry it is another one, or none, pitches."""
_TURNED = 0.5
"""Or so far turned from there, rad."""
_ROBUST_SCALE = 6.0
_RIM = 0.5
"""Part of a unit's radius by which its middle may lie out of the picture."""
_COLLISION_DISTANCE = 0.5
"""Two units nearer to each other than this part of their least distance at rest are one."""
_ROUNDS = 40
_RETRIES = 4


class Shutter(NamedTuple):
    """Holds the shutter of a camera."""

    exposure: float | None = None  # of a row, s; without it, the first quick motions tell
    readout: float = 0.0  # from the first row to the last, s; negative where these are upside down
    noise: float = 0.0  # residuals to expect of the sensor's noise, levels


_GLOBAL = Shutter()


class UnitStates(NamedTuple):
    """Holds what is known of the units (units, ...) when a frame comes."""

    pose: Floats  # (units, 3) in the frame before, mm and rad
    velocity: Floats  # (units, 3) mm/s and rad/s
    photometry: Floats  # (units, 4) in the frame before
    usual: Floats  # (units,) residuals, over the gain; zero if unknown
    interval: float = 0.0  # since that frame, s


class UnitSearch:
    """Searches a specimen's units in a frame.

    Args:
        specimen: the units.
        fitter: the camera and the units' templates.
        relocaliser: tells what is in view.
        walls: of thick units.
        shutter: of the camera.
        blur: by the exposure; without it, none is allowed for.
        coarse: finds units from farther away, where a pitch has pixels enough for it.

    Attributes:
        fitter, relocaliser, shutter: as given.
        exposure: of a row, measured if it is not given.
        appearance: of the units in the first frame, once it is there.
        neighbours: which units tell where others are.
        pixel: size of a pixel at the middle of the specimen, mm.
    """

    def __init__(
        self,
        specimen: SpecimenOutlines,
        fitter: PoseFitter,
        relocaliser: Relocaliser,
        walls: SideWalls | None = None,
        shutter: Shutter = _GLOBAL,
        blur: ExposureBlur | None = None,
        coarse: CoarseLevel | None = None,
    ) -> None:
        self.fitter, self.relocaliser, self._walls = fitter, relocaliser, walls
        self.shutter, self._blur, self._coarse = shutter, blur, coarse
        self.exposure = ExposureMeter(shutter.exposure, fitter.templates.noise, blur is not None)
        self.appearance: ReferenceAppearance | None = None
        self.neighbours = Neighbourhood(specimen.centre)
        self._stray = _STRAY * specimen.pitch
        middle = specimen.centre.mean(axis=0)
        self.pixel = 1 / float(fitter.camera.px_per_mm(middle))

    def predicted(self, known: UnitStates) -> Floats:
        """Extrapolates the poses by their velocities, and redraws the walls there."""
        ahead = known.pose + known.velocity * known.interval
        if self._walls is not None:
            self._walls.redraw(ahead)
        return ahead

    def fit(
        self,
        image: Picture,
        known: UnitStates,
        pose: Floats,
        photometry: Floats,
        chosen: Mask | None = None,
        tight: Floats | None = None,
    ) -> PoseFits:
        """Fits units as they move while the frame is exposed and read out.

        Arguments but ``known`` are those of `PoseFitter.fit`.
        """
        rows = self.fitter.camera.size[1]
        drift = known.velocity * (self.shutter.readout / rows) if self.shutter.readout else None
        if self._blur is not None:
            travel = known.velocity * self.exposure.time
            cos, sin = np.cos(known.pose[:, 2]), np.sin(known.pose[:, 2])
            x, y = travel[:, 0], travel[:, 1]
            own = np.stack([cos * x + sin * y, cos * y - sin * x, travel[:, 2]], axis=1)
            self._blur.redraw(own, chosen)
        usual = known.usual if chosen is None else None
        return self.fitter.fit(image, pose, photometry, chosen, tight, usual, drift)

    def fit_coarse_first(
        self,
        image: Picture,
        known: UnitStates,
        guess: Floats,
        photometry: Floats,
        chosen: Mask,
    ) -> PoseFits:
        """Fits the chosen units from where the coarse level finds them, if there is one."""
        if self._coarse is not None:
            found = self._coarse.fit(image, guess, photometry, chosen)
            there = self._near(found, guess) & (found.share > SHARE_KNOWN)
            guess = np.where(there[:, None], found.pose, guess)
        return self.fit(image, known, guess, photometry, chosen)

    def refit_missed(self, image: Picture, known: UnitStates, fits: PoseFits) -> None:
        """Fits anew, in place, units that went farther than their own pixels tell."""
        if self._coarse is None:
            return
        ahead = self.predicted(known)
        missed = ~self.accepted(fits, known, sharp=False) & self._reachable(ahead)
        if not missed.any():
            return
        again = self.fit_coarse_first(image, known, ahead, known.photometry, missed)
        fits.take(again, missed & (again.share > np.nan_to_num(fits.share)))

    @property
    def allows_motion(self) -> bool:
        """Tests whether units are fitted as they move while a frame is exposed or read out."""
        return bool(self.shutter.readout) or self._blur is not None

    @property
    def bend_share(self) -> Reals:
        """Shares (units, 2) of accelerations that the blurred frame shows, as `ExposureBlur`."""
        count = len(self.fitter.templates.centre)
        return np.ones((count, 2), np.float16) if self._blur is None else self._blur.share.copy()

    def accepted(
        self, fits: PoseFits, known: UnitStates, share: float = SHARE, sharp: bool = True
    ) -> Mask:
        """Accepts fits; one that its motion may have blurred needs to be seen whole."""
        assert self.appearance is not None, "the first frame is the reference"
        quick = None
        if sharp and not self.exposure.time and known.interval > 0:
            quick = np.linalg.norm((fits.pose - known.pose)[:, :2], axis=1) > _QUICK * self.pixel
        return self.appearance.accepted(fits, known.photometry, share, quick)

    def complete(self, image: Picture, known: UnitStates, fits: PoseFits, good: Mask) -> Mask:
        """Fits missing units at predictions by the good ones; fits are filled in place."""
        if not good.any():
            return good
        return self._retry_hidden(image, known, fits, self._propagate(image, known, fits, good))

    def try_missing(
        self,
        image: Picture,
        known: UnitStates,
        fits: PoseFits,
        good: Mask,
        trial: tuple[Floats, Floats, Floats | None, float],
    ) -> Mask:
        """Fits missing units from a guess; keeps those accepted near it, but for outliers.

        A trial is the guess of poses, photometry, the scale of residuals where the pose is nearly
        known, and the least share of a unit's information.
        """
        guess, photometry, tight, least = trial
        missing = ~good & self._reachable(guess)
        if not missing.any():
            return good
        again = self.fit(image, known, guess, photometry, missing, tight)
        new = self.accepted(again, known, least) & missing & self._near(again, guess)
        both = fits.copy()
        both.take(again, new)
        new &= ~self.neighbours.outliers(both.pose, good | new, self._stray)
        fits.take(again, new)
        return good | new

    def collisions(self, fits: PoseFits, good: Mask) -> Mask:
        """Finds good units (units,) that claim one place."""
        return self.neighbours.collisions(fits.pose, good, _COLLISION_DISTANCE)

    def _reachable(self, guess: Floats) -> Mask:
        """Marks guesses (units, 3) that are in view, if only in part."""
        return np.isfinite(guess[:, 0]) & self.relocaliser.in_view(guess, -_RIM)

    def _near(self, fits: PoseFits, guess: Floats) -> Mask:
        """Marks fits (units,) that ended near where they began, and so are no other unit's."""
        off = np.linalg.norm(fits.pose[:, :2] - guess[:, :2], axis=1)
        turned = np.abs(fits.pose[:, 2] - guess[:, 2])
        return np.asarray((off < self._stray) & (turned < _TURNED))

    def _propagate(self, image: Picture, known: UnitStates, fits: PoseFits, good: Mask) -> Mask:
        """Tries the units that were not found where their neighbours would have carried them."""
        for _ in range(_ROUNDS):
            good &= ~self.neighbours.outliers(fits.pose, good, self._stray)
            guess = self.neighbours.predict_rigid(known.pose, fits.pose, good, ~good)
            missing = self._reachable(guess)
            if not missing.any():
                break
            photometry = known.photometry * gain_change(fits, known, good)
            again = self.fit_coarse_first(image, known, guess, photometry, missing)
            new = self.accepted(again, known) & missing & self._near(again, guess)
            if not new.any():
                break
            fits.take(again, new)
            good |= new
        return good

    def _retry_hidden(self, image: Picture, known: UnitStates, fits: PoseFits, good: Mask) -> Mask:
        """Tries those again that may be hidden in part: place and brightness are known."""
        assert self.appearance is not None, "the first frame is the reference"
        photometry = known.photometry * gain_change(fits, known, good)
        tight = _ROBUST_SCALE * self.appearance.noise * np.abs(photometry[:, 0])
        for _ in range(_RETRIES):
            if good.all():
                break
            before = int(good.sum())
            for guess in self._hidden_poses(known, fits, good):
                for least, scale in ((SHARE, None), (SHARE_KNOWN, tight)):
                    trial = guess, photometry, scale, least
                    good = self.try_missing(image, known, fits, good, trial)
            if good.sum() == before:
                break
        return good

    def _hidden_poses(self, known: UnitStates, fits: PoseFits, good: Mask) -> Iterator[Floats]:
        """Guesses poses of hidden units: carried on, or stretched with those that are seen.

        Units of these lattices turn with or against their neighbours, so both are tried.
        """
        carried = self.neighbours.predict_rigid(known.pose, fits.pose, good, ~good)
        ahead = self.predicted(known)
        yield np.where(np.isfinite(carried), carried, ahead)
        yield ahead
        place = self.neighbours.predict_affine(fits.pose, good, ~good)
        turn = self.neighbours.rotation_size(fits.pose, good, ~good)
        for angle in (turn, -turn, np.zeros_like(turn)):
            yield np.column_stack([place, angle])


def gain_change(fits: PoseFits, known: UnitStates, good: Mask) -> float:
    """Measures how much brighter the frame is than the one before."""
    if not good.any():
        return 1.0
    return float(np.median(fits.photometry[good, 0] / known.photometry[good, 0]))
