"""Bends shims as their slots do: length, angles at both ends, strain and moment before any load.

A shim is a strip that is clamped where the walls of its two slots begin, and slides in them:
against the chord between these places it leaves one slot at an angle a and enters the other at an
angle b. What is built is an elastica. Where slots are compared, the theory of slender beams ranks
them (small slopes; at 30 deg some 5 % more than the elastica's): its deflection is a cubic, so that
its curvature is linear along the chord's length l,

    from -(4 a + 2 b) / l at the one end to (2 a + 4 b) / l at the other.

Least of all b is bent by a slot that is turned by a if the other is turned by -a: to an arc.
"""

from typing import NamedTuple

import numpy as np

from pipeline.fabrication.parts import Slot
from pipeline.fabrication.units.elastica import strip_between
from pipeline.problem.sections import Fabrication
from sim.core import Floats
from sim.structure import angle_between


class PreBend(NamedTuple):
    """Tells how a shim is bent before any load.

    Its angles are the natural ones of a ligament whose foil is straight by itself.
    """

    free: float  # length along the shim between the places where the slots hold it, mm
    angles: tuple[float, float]  # of slots against the ligament, first unit to second, rad, ccw
    strain: float  # largest one at the foil's faces; infinite where no shim stays in the slots
    moment: float  # largest one, N mm


def prebend(first: Slot, second: Slot, settings: Fabrication) -> PreBend:
    """Computes how the shim between the slots of two units is bent."""
    shims, (start, end) = settings.shims, _slot_directions(first, second)
    strip = strip_between(first.held, start, second.held, end)
    stiffness = shims.young_modulus * settings.thickness * shims.thickness**3 / 12.0  # E I
    strain, moment = shims.thickness / 2.0 * strip.curvature, stiffness * strip.curvature
    return PreBend(strip.length, slot_angles(first, second), strain, moment)


def slot_angles(first: Slot, second: Slot) -> tuple[float, float]:
    """Measures the slots at both ends of a ligament against it, rad, counter-clockwise."""
    along = second.mouth - first.mouth
    start, end = (float(angle_between(along, way)) for way in _slot_directions(first, second))
    return start, end


def slender_strain(first: Slot, second: Slot, settings: Fabrication) -> float:
    """Estimates the strain of the shim between two slots, by small slopes."""
    start, end = _slot_directions(first, second)
    curvature = peak_curvature(first.held, start, second.held, end)
    return settings.shims.thickness / 2.0 * float(curvature)


def _slot_directions(first: Slot, second: Slot) -> tuple[Floats, Floats]:
    """Returns unit vectors (2,) along a shim, out of one slot and into the other."""
    return -first.direction, second.direction


def peak_curvature(start: Floats, leaves: Floats, end: Floats, enters: Floats) -> Floats:
    """Estimates the largest curvature (...) of strips between clamps, by small slopes, 1/mm.

    Args:
        start: (..., 2) where strips are clamped, mm.
        leaves: (..., 2) unit vectors along the strips there.
        end: (..., 2) the other ends, mm.
        enters: (..., 2) unit vectors along the strips there.
    """
    chord = end - start
    length = np.linalg.norm(chord, axis=-1)
    a, b = angle_between(chord, leaves), angle_between(chord, enters)
    return np.asarray(np.maximum(np.abs(4 * a + 2 * b), np.abs(2 * a + 4 * b)) / length)
