"""Bends shims as their slots do: angles at both ends, strain and moment before any load.

A shim is a strip that is clamped where the walls of its two slots begin. Against the chord between
these places it leaves one slot at an angle a and enters the other at an angle b. By the theory of
slender beams (small slopes; at 30 deg some 5 % more than the elastica's) its deflection is a cubic,
so that its curvature is linear along the chord's length l:

    from -(4 a + 2 b) / l at the one end to (2 a + 4 b) / l at the other.

Least of all b is bent by a slot that is turned by a if the other is turned by -a: to an arc.
"""

from typing import NamedTuple

import numpy as np

from pipeline.fabrication.parts import Slot
from pipeline.problem.sections import Fabrication
from sim.core import Floats


class PreBend(NamedTuple):
    """Tells how a shim is bent before any load.

    Its angles are the natural ones of a ligament whose foil is straight by itself.
    """

    angles: tuple[float, float]  # of slots against the ligament, first unit to second, rad, ccw
    strain: float  # largest one at the foil's faces
    moment: float  # largest one, N mm


def prebend(first: Slot, second: Slot, settings: Fabrication) -> PreBend:
    """Computes how the shim between the slots of two units is bent."""
    shims, along = settings.shims, second.mouth - first.mouth
    curvature = float(peak_curvature(first.held, -first.direction, second.held, second.direction))
    stiffness = shims.young_modulus * settings.thickness * shims.thickness**3 / 12.0  # E I
    a, b = (float(signed_angle(along, way)) for way in (-first.direction, second.direction))
    return PreBend((a, b), shims.thickness / 2.0 * curvature, stiffness * curvature)


def peak_curvature(start: Floats, leaves: Floats, end: Floats, enters: Floats) -> Floats:
    """Computes the largest curvature (...) of strips between clamps, 1/mm.

    Args:
        start: (..., 2) where strips are clamped, mm.
        leaves: (..., 2) unit vectors along the strips there.
        end: (..., 2) the other ends, mm.
        enters: (..., 2) unit vectors along the strips there.
    """
    chord = end - start
    length = np.linalg.norm(chord, axis=-1)
    a, b = signed_angle(chord, leaves), signed_angle(chord, enters)
    return np.asarray(np.maximum(np.abs(4 * a + 2 * b), np.abs(2 * a + 4 * b)) / length)


def signed_angle(first: Floats, second: Floats) -> Floats:
    """Measures angles (...) from vectors (..., 2) to others, rad, counter-clockwise."""
    cross = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return np.asarray(np.arctan2(cross, (first * second).sum(axis=-1)))
