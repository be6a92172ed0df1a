"""Predicts units from their own past, and from how their neighbours moved."""

import numpy as np
from scipy.spatial import cKDTree

from pipeline.tracking.geometry import rigid_motion, rotation_matrix
from sim.core import Floats, Ints, Mask

_NEAREST = 6


def latest_velocity(seen: list[tuple[float, Floats]]) -> Floats:
    """Returns the time derivative (units, 3) at the last of the frames seen.

    It is that of the polynomial through all of them; of fewer, the last ones, where a unit is not
    in all; NaN where it is in fewer than two.

    Args:
        seen: times, s, and poses (units, 3) there, NaN where missing.
    """
    out = np.full_like(seen[-1][1], np.nan)
    for first in range(len(seen) - 1):
        time = np.array([one for one, _ in seen[first:]])
        if (np.diff(time) <= 0).any():
            continue
        powers = (time - time[-1]) ** np.arange(len(time))[:, None]
        weight = np.linalg.solve(powers, np.arange(len(time)) == 1)
        told = np.tensordot(weight, [pose for _, pose in seen[first:]], 1)
        out = np.where(np.isfinite(out), out, told)
    return out


class Neighbourhood:
    """Predicts units from those about them that were found.

    Args:
        centre: (units, 2) places at rest, mm.
    """

    def __init__(self, centre: Floats) -> None:
        self._centre = centre
        self._neighbours_of = np.zeros(0, dtype=bool)
        self._neighbours: tuple[Ints, Ints, Floats, Floats]
        self._apart = cKDTree(centre).query(centre, k=2)[0][:, 1]

    def collisions(self, found: Floats, good: Mask, least: float) -> Mask:
        """Finds good units that collide: nearer than a part of their distance at rest."""
        out = np.zeros(len(found), dtype=bool)
        places = np.nonzero(good)[0]
        if len(places) < 2:
            return out
        now = self._centre[places] + found[places, :2]
        distance, other = (values[:, 1] for values in cKDTree(now).query(now, k=2))
        usual = np.minimum(self._apart[places], self._apart[places[other]])
        out[places] = distance < least * usual
        return out

    def predict_rigid(self, known: Floats, found: Floats, good: Mask, missing: Mask) -> Floats:
        """Predicts poses of the missing units that move rigidly with the nearest good ones.

        Args:
            known: (units, 3) poses that all had before.
            found: (units, 3) poses of the good ones now.
            good: (units,) which those are.
            missing: (units,) whose poses to predict.

        Returns:
            (units, 3), NaN where nothing is known.
        """
        out = np.full_like(known, np.nan)
        base = good & np.isfinite(known[:, 0])
        if base.sum() < 3:
            return out
        places = np.nonzero(base)[0]
        old, new = (self._centre + pose[:, :2] for pose in (known, found))
        tree = cKDTree(old[places])
        for unit in np.nonzero(missing & np.isfinite(known[:, 0]))[0]:
            near = places[tree.query(old[unit], k=min(_NEAREST, len(places)))[1]]
            turn, shift = rigid_motion(old[near], new[near])
            moved = rotation_matrix(turn) @ old[unit] + shift
            out[unit] = (*(moved - self._centre[unit]), known[unit, 2] + turn)
        return out

    def predict_affine(self, found: Floats, good: Mask, missing: Mask) -> Floats:
        """Predicts displacements (units, 2) of missing units that move affinely with the good ones.

        Other than `predict_rigid` it needs no past, and so does not drift while a unit is hidden.
        """
        out = np.full((len(found), 2), np.nan)
        places = np.nonzero(good)[0]
        if len(places) < _NEAREST:
            return out
        tree = cKDTree(self._centre[places])
        for unit in np.nonzero(missing)[0]:
            near = places[tree.query(self._centre[unit], k=min(2 * _NEAREST, len(places)))[1]]
            rows = np.column_stack([self._centre[near] - self._centre[unit], np.ones(len(near))])
            out[unit] = np.linalg.lstsq(rows, found[near, :2], rcond=None)[0][2]
        return out

    def rotation_size(self, found: Floats, good: Mask, missing: Mask) -> Floats:
        """Returns the median rotation (units,) of the good units about each missing one, rad."""
        out = np.full(len(found), np.nan)
        places = np.nonzero(good)[0]
        if len(places) < _NEAREST:
            return out
        tree = cKDTree(self._centre[places])
        for unit in np.nonzero(missing)[0]:
            near = places[tree.query(self._centre[unit], k=_NEAREST)[1]]
            out[unit] = np.median(np.abs(found[near, 2]))
        return out

    def outliers(self, found: Floats, good: Mask, most: float) -> Mask:
        """Finds good units farther than ``most`` (mm) from where their neighbours carry them.

        The median over an affine map of the nearest ones decides, so that strain is no outlier.
        """
        out = np.zeros(len(found), dtype=bool)
        if np.count_nonzero(good) < 9:
            return out
        if not np.array_equal(good, self._neighbours_of):
            self._neighbours_of, self._neighbours = good.copy(), self._affine_neighbours(good)
        places, near, offset, inverse = self._neighbours
        now = self._centre + found[:, :2]
        fit = inverse @ np.einsum("uki,ukj->uij", offset, now[near])
        middle = np.median(now[near] - offset @ fit, axis=1)
        out[places] = np.linalg.norm(now[places] - fit[:, 2] - middle, axis=1) > most
        return out

    def _affine_neighbours(self, good: Mask) -> tuple[Ints, Ints, Floats, Floats]:
        """Lists good units (n,) with the nearest ones (n, 8), and what an affine map of them needs.

        That is their places (n, 8, 3) from the unit's own, with a one, and the inverse (n, 3, 3) of
        the normal matrix.
        """
        places = np.nonzero(good)[0]
        near = places[cKDTree(self._centre[places]).query(self._centre[places], k=9)[1][:, 1:]]
        away = self._centre[near] - self._centre[places][:, None]
        offset = np.concatenate([away, np.ones((*near.shape, 1))], axis=2)
        normal = np.einsum("uki,ukj->uij", offset, offset) + 1e-6 * np.eye(3)
        return places, near, offset, np.linalg.inv(normal)
