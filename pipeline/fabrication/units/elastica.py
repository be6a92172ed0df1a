"""Bends a strip between two clamps in which it slides: its length and its largest curvature.

Such a strip, straight by itself, takes the length that makes its bending energy least. Where its
clamps are at a distance of 1 and u is the share of its length, its slope t(u) makes

    int cos t du * int t'^2 du least, and int sin t du = 0:

the first integral is one over its length, and the last is zero where it ends at the other clamp.
The slope is a polynomial that Newton's method finds as the ends are turned from straight.
"""

from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre, leggauss

from sim.core import Floats
from sim.structure import angle_between

_TERMS = 10  # of the slope, beside the linear one
_PARTS = 6  # in which the ends are turned
_STEPS, _SMALL = 20, 1e-9  # of Newton's method
_SEEN = np.linspace(0.0, 1.0, 201)  # where curvatures are looked at
_NODES, _WEIGHTS = 0.5 + leggauss(32)[0] / 2.0, leggauss(32)[1] / 2.0
_BUBBLE = Polynomial([0.0, 1.0, -1.0])  # zero at both ends
_SHAPES = [
    Legendre.basis(k, domain=[0.0, 1.0]).convert(kind=Polynomial) * _BUBBLE for k in range(_TERMS)
]
_SLOPE = np.stack([shape(_NODES) for shape in _SHAPES])  # (terms, nodes)
_RATE, _RATE_SEEN = (
    np.stack([shape.deriv()(places) for shape in _SHAPES]) for places in (_NODES, _SEEN)
)


class BentStrip(NamedTuple):
    """Holds the measures of a strip whose clamps are at a distance of 1."""

    length: float
    curvature: float  # largest one


def bent_strip(start: float, end: float) -> BentStrip:
    """Finds the strip that leaves one clamp and enters another at angles to their line, rad.

    Its measures are infinite where no strip rests between such clamps.
    """
    unknowns = np.zeros(_TERMS + 1)
    for part in np.linspace(0.0, 1.0, _PARTS + 1)[1:]:
        for _ in range(_STEPS):
            step = _newton_step(part * start, part * end, unknowns)
            unknowns = unknowns + step
            if np.abs(step).max() < _SMALL:
                break
        else:
            return BentStrip(np.inf, np.inf)
    slope = start + (end - start) * _NODES + unknowns[:-1] @ _SLOPE
    length = 1.0 / float(_WEIGHTS @ np.cos(slope))
    rate = end - start + unknowns[:-1] @ _RATE_SEEN
    return BentStrip(length, float(np.abs(rate).max()) / length)


def strip_between(start: Floats, leaves: Floats, end: Floats, enters: Floats) -> BentStrip:
    """Finds the strip between two clamps, its length in mm and its largest curvature in 1/mm.

    Args:
        start: (2,) where it is clamped, mm.
        leaves: (2,) unit vector along it there.
        end: (2,) the other end, mm.
        enters: (2,) unit vector along it there.
    """
    chord = end - start
    distance = float(np.linalg.norm(chord))
    strip = bent_strip(*(float(angle_between(chord, way)) for way in (leaves, enters)))
    return BentStrip(strip.length * distance, strip.curvature / distance)


def _newton_step(start: float, end: float, unknowns: Floats) -> Floats:
    """Computes the next step of the slope's terms and of the multiplier behind them."""
    slope = start + (end - start) * _NODES + unknowns[:-1] @ _SLOPE
    rate = end - start + unknowns[:-1] @ _RATE
    cosine, sine, multiplier = _WEIGHTS * np.cos(slope), _WEIGHTS * np.sin(slope), unknowns[-1]
    along, bending = cosine.sum(), _WEIGHTS @ rate**2
    d_along, d_across, d_bending = -_SLOPE @ sine, _SLOPE @ cosine, 2 * _RATE @ (_WEIGHTS * rate)
    mixed = np.outer(d_along, d_bending)
    weights = bending * cosine + multiplier * sine
    hessian = mixed + mixed.T + 2 * along * (_RATE * _WEIGHTS) @ _RATE.T
    hessian -= (_SLOPE * weights) @ _SLOPE.T
    gradient = d_along * bending + along * d_bending + multiplier * d_across
    bordered = np.zeros((_TERMS + 1, _TERMS + 1))
    bordered[:-1, :-1], bordered[:-1, -1], bordered[-1, :-1] = hessian, d_across, d_across
    return np.asarray(np.linalg.solve(bordered, -np.append(gradient, sine.sum())))
