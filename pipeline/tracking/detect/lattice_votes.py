"""Locates a lattice among patches of an image: votes of all pairs, then growth from the best place.

Two neighbouring patches and two joined units vote for a turn, every patch and every unit for a
shift (a generalised Hough transform: Ballard, Pattern Recognition 13 (1981) 111). Patches that are
no units, and units without a patch, win votes for nothing. From the place with most votes the match
grows over the joints, then over gaps between parts of a design, where the affine map of the nearest
matches says: lenses bend lattices, and loads deform them.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import cv2
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from sim.core import Floats, Ints, Mask

_LEAST_MATCHES = 6
_ANGLE_BINS = 72
_LARGEST_LOG_RATIO = 0.3
"""Logarithm of the size of a pair of neighbours over that of joined units, at most."""
_MOST_JOINTS = 64
_BIN_WIDTH, _NEAR, _GATE = 0.25, 0.3, 0.35
"""Width of a bin of shifts; distance of a patch from a unit at first and in growth; in pitches."""
_GROWTH_REACH = 1.7
"""Units are reached from matches so far, over the length of a joint, or of the widest gap."""
_TURNS_KEPT, _SHIFTS_KEPT = 0.6, 0.75
"""Votes of further candidates, over those of the best."""
_MOST_SHIFTS, _MOST_SEEDS = 256, 3
_EQUIVALENT = 0.95
"""Matches of further seeds, over those of the best, where more than usual are asked for."""
_SUFFICIENT = 0.98
"""Score, over the number of units, after which no other shift is tried."""
_NEIGHBOURS, _RIDGE = 8, 0.05
_ROUNDS = 80
_FARTHEST, _NEAREST_DISTANCE = 1.55, 0.6
"""Distance of neighbours, diagonal ones too, between these, pitches."""

Inside = Callable[[Floats], Mask]


class Placement(NamedTuple):
    """Holds one way in which units lie among patches."""

    unit: Ints  # (matches,) pairs, one unit a patch
    patch: Ints  # likewise
    place: Floats  # (units, 2) where all are, by the matches and what they say of the others
    turn: float  # of the lattice against its reference, rad
    missing: int  # number of units without a patch that should be in view
    surplus: int  # number of patches without a unit that go on with the lattice

    @property
    def score(self) -> int:
        """Returns matches less what should be there and is not, and the reverse."""
        return len(self.unit) - self.missing - self.surplus


def locate_lattice(
    points: Floats,
    joint: Ints,
    patches: Floats,
    scale: float,
    inside: Inside,
    most_turn: float = np.pi,
    most_seeds: int = _MOST_SEEDS,
) -> list[Placement]:
    """Places units among patches, not mirrored; the best placement comes first.

    Args:
        points: (units, 2) places of the units in the reference.
        joint: (ligaments, 2) joined units.
        patches: (n, 2) places of the patches.
        scale: of the patches' frame against the reference, roughly.
        inside: tells places (..., 2) that are in view.
        most_turn: the largest angle to look for, rad.
        most_seeds: largest number of places to start from, of a turn, that match as much.
    """
    if len(patches) < _LEAST_MATCHES or len(points) < _LEAST_MATCHES:
        return []
    ends = points[joint]
    vectors = (ends[:, 1] - ends[:, 0]) @ np.array([1, 1j])
    pitch = scale * float(np.median(np.abs(vectors)))
    gap = float(minimum_spanning_tree(cdist(points, points)).max())
    joined = float(np.median(np.ptp(ends, axis=1).max(axis=1)))
    reach = _GROWTH_REACH * joined, _GROWTH_REACH * max(joined, gap)
    found: list[Placement] = []
    for factor in _vote_factors(vectors, patches, scale, pitch, most_turn):
        turned = _transformed(points, factor)
        shifts = _vote_shifts(turned, patches, _BIN_WIDTH * pitch)
        wide = pitch * abs(factor) / scale
        matches = _first_matches(turned, joint, shifts, patches, _NEAR * wide)
        seeds = [
            _Growth(points, reach, turned + shift, patches, wide, match)
            for shift, match in zip(shifts, matches, strict=True)
        ]
        for seed in _best_seeds(seeds, inside, most_seeds):
            grown = seed.placement(factor, inside)
            if grown is not None:
                found.append(grown)
            if grown is not None and grown.score > _SUFFICIENT * len(points):
                break
    return sorted(found, key=lambda one: -one.score)


def _best_seeds(seeds: list["_Growth"], inside: Inside, most: int) -> list["_Growth"]:
    """Returns the seeds of best rank, and that of most matches less what is missing.

    A column alone in view matches each of the lattice's; what is missing beside it tells which.
    """
    ranks = {seed: seed.rank(inside) for seed in seeds}
    ranked = sorted(seeds, key=ranks.__getitem__)
    net = min(ranked, key=lambda one: sum(ranks[one]), default=None)
    equal = [one for one in ranked[:most] if one.size >= _EQUIVALENT * ranked[0].size]
    best = max(ranked[:_MOST_SEEDS], equal, key=len)
    return [*([net] if net else []), *(one for one in best if one is not net)]


def match_one_to_one(expected: Floats, found: Floats, gate: float) -> tuple[Ints, Ints]:
    """Pairs places that are each other's nearest, no farther than ``gate``."""
    distance, near = cKDTree(found).query(expected, distance_upper_bound=gate)
    back = cKDTree(expected).query(found)[1]
    units = np.flatnonzero(np.isfinite(distance))
    units = units[back[near[units]] == units]
    return units, near[units]


def _transformed(points: Floats, factor: complex) -> Floats:
    turned = (points @ np.array([1, 1j])) * factor
    return np.stack([turned.real, turned.imag], axis=-1)


def _vote_factors(
    vectors: np.ndarray, patches: Floats, scale: float, pitch: float, most_turn: float
) -> Iterator[complex]:
    """Yields turns with scales, as complex factors, that most pairs of neighbours vote for."""
    pairs = cKDTree(patches).query_pairs(1.4 * pitch, output_type="ndarray")
    seen = (patches[pairs[:, 1]] - patches[pairs[:, 0]]) @ np.array([1, 1j])
    seen = seen[np.abs(seen) > 0.6 * pitch]
    few = vectors[:: -(-len(vectors) // _MOST_JOINTS)]
    ratio = (seen[:, None] / np.concatenate([few, -few])).ravel()
    ratio = ratio[np.abs(np.log(np.abs(ratio) / scale)) < _LARGEST_LOG_RATIO]
    ratio = ratio[np.abs(np.angle(ratio)) <= most_turn]
    if not len(ratio):
        return
    width = 2 * np.pi / _ANGLE_BINS
    bins = np.round(np.angle(ratio) / width).astype(int) % _ANGLE_BINS
    votes = np.bincount(bins, minlength=_ANGLE_BINS).astype(float)
    votes += np.roll(votes, 1) + np.roll(votes, -1)
    peak = (votes >= np.roll(votes, 1)) & (votes > np.roll(votes, -1))
    peak &= votes > _TURNS_KEPT * votes.max()
    for angle in np.flatnonzero(peak) * width:
        near = ratio[np.abs(np.angle(ratio * np.exp(-1j * angle))) < 1.5 * width]
        yield complex(np.exp(np.log(near * np.exp(-1j * angle)).mean() + 1j * angle))


def _vote_shifts(turned: Floats, patches: Floats, width: float) -> Floats:
    """Returns the shifts (n, 2) that most pairs of patch and unit vote for, the best first."""
    pairs = (patches[:, None] - turned).reshape(-1, 2)
    low = pairs.min(axis=0)
    cells = np.round((pairs - low) / width).astype(int)
    votes = np.zeros(cells.max(axis=0) + 1, np.float32)
    np.add.at(votes, tuple(cells.T), 1.0)
    votes = np.asarray(cv2.GaussianBlur(votes, (5, 5), 1.0, borderType=cv2.BORDER_CONSTANT))
    highest = votes == cv2.dilate(votes, np.ones((5, 5), np.uint8))
    places = np.argwhere(highest & (votes > _SHIFTS_KEPT * votes.max()))
    order = np.argsort(-votes[tuple(places.T)], kind="stable")[:_MOST_SHIFTS]
    return np.asarray(low + places[order] * width)


def _first_matches(
    turned: Floats, joint: Ints, shifts: Floats, patches: Floats, gate: float
) -> Ints:
    """Finds the patches (n_shifts, units) at shifted units, -1 for none: largest joined part each.

    A unit and its patch are each other's nearest, no farther than ``gate``.
    """
    number = np.arange(len(turned))
    distance, near = cKDTree(patches).query(turned + shifts[:, None], distance_upper_bound=gate)
    back = cKDTree(turned).query(patches - shifts[:, None])[1]
    near = np.where(np.isfinite(distance), near, 0)
    known = np.isfinite(distance) & (np.take_along_axis(back, near, axis=1) == number)
    shift, both = np.nonzero(known[:, joint].all(axis=2))
    ends = (joint[both] + len(number) * shift[:, None]).T
    graph = coo_array((np.ones(ends.shape[1]), tuple(ends)), (known.size, known.size))
    part = connected_components(graph, directed=False)[1]
    size = np.bincount(part[known.ravel()], minlength=known.size)[part] * known.ravel()
    part, size = part.reshape(known.shape), size.reshape(known.shape)
    largest = np.take_along_axis(part, size.argmax(axis=1)[:, None], axis=1)
    return np.where(known & (part == largest), near, -1)


class _Growth:
    """Grows a match from where a linear map agrees with the patches, over the joints."""

    def __init__(
        self,
        points: Floats,
        reach: tuple[float, float],
        linear: Floats,
        patches: Floats,
        pitch: float,
        match: Ints,
    ) -> None:
        self._points, self._linear, self._patches, self._pitch = points, linear, patches, pitch
        self._reach = reach  # over the joints, and over gaps between parts of a design
        self._patch = match.copy()  # (units,) of every unit, -1 for none

    @property
    def size(self) -> int:
        """Counts the matches."""
        return int((self._patch >= 0).sum())

    def rank(self, inside: Inside) -> tuple[int, int]:
        """Returns what sorts matches before growth: the most first, then the fewest units missing.

        A lens or a load takes units off the linear map, so ones missing do not outweigh matches.
        """
        known = self._patch >= 0
        off = self._patches[self._patch[known]] - self._linear[known]
        place = self._linear + np.median(off, axis=0) if len(off) else self._linear
        return -self.size, int((inside(place) & ~known).sum())

    def placement(self, factor: complex, inside: Inside) -> Placement | None:
        """Returns the match at its largest; nothing if it is small."""
        place = self._grow()
        if place is None:
            return None
        off = np.linalg.norm(place - self._observed(place), axis=1)
        self._patch[off > _GATE * self._pitch] = -1
        unit = np.flatnonzero(self._patch >= 0)
        if len(unit) < _LEAST_MATCHES:
            return None
        missing = int((inside(place) & (self._patch < 0)).sum())
        return Placement(
            unit,
            self._patch[unit],
            self._observed(place),
            float(np.angle(factor)),
            missing,
            self._count_surplus(),
        )

    def _grow(self) -> Floats | None:
        """Matches more units in turns; returns where all are expected, None if too few match."""
        if self.size < _LEAST_MATCHES:
            return None
        place, far = self._extrapolated()
        for reach in self._reach:
            for _ in range(_ROUNDS):
                if not self._match((self._patch < 0) & (far < reach), place):
                    break
                place, far = self._extrapolated()
        return place

    def _match(self, alone: Mask, place: Floats) -> bool:
        """Matches units with free patches at their places; returns whether there were any."""
        free = np.setdiff1d(np.arange(len(self._patches)), self._patch)
        if not (alone.any() and len(free)):
            return False
        unit, patch = match_one_to_one(place[alone], self._patches[free], _GATE * self._pitch)
        self._patch[np.flatnonzero(alone)[unit]] = free[patch]
        return bool(len(unit))

    def _count_surplus(self) -> int:
        """Counts patches without a unit that continue the lattice, about a pitch from others."""
        taken = np.zeros(len(self._patches), bool)
        taken[self._patch[self._patch >= 0]] = True
        apart = cdist(self._patches, self._patches)
        beside = (apart < _FARTHEST * self._pitch) & (apart > _NEAREST_DISTANCE * self._pitch)
        before = int(taken.sum())
        for _ in range(_ROUNDS):
            more = ~taken & (beside[:, taken].sum(axis=1) > 1)
            if not more.any():
                break
            taken |= more
        return int(taken.sum()) - before

    def _observed(self, place: Floats) -> Floats:
        """Replaces expected places by those of the units' own patches."""
        return np.where(self._patch[:, None] >= 0, self._patches[self._patch], place)

    def _extrapolated(self) -> tuple[Floats, Floats]:
        """Extrapolates places (units, 2) from other matches; gives distances of the nearest too."""
        known = np.flatnonzero(self._patch >= 0)
        off = self._patches[self._patch[known]] - self._linear[known]
        count = min(_NEIGHBOURS + 1, len(known))
        far, near = cKDTree(self._points[known]).query(self._points, k=count)
        other = known[near] != np.arange(len(self._points))[:, None]
        offset = (self._points[known][near] - self._points[:, None]) / self._reach[0]
        rows = np.concatenate([offset, np.ones((*near.shape, 1))], axis=2) * other[..., None]
        normal = np.einsum("uki,ukj->uij", rows, rows) + _RIDGE * np.diag([1.0, 1.0, 1e-6])
        right = np.einsum("uki,ukj->uij", rows, off[near])
        return self._linear + np.linalg.solve(normal, right)[:, 2], far[:, 0]
