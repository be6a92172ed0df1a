"""Declares the substeps at contact on void angles, which ``contact_substeps.c`` takes."""

from typing import NamedTuple

from sim.core import Floats


class Substeps(NamedTuple):
    """Describes the splitting by which substeps are taken."""

    drifts: Floats  # (n_kicks + 1,) parts of a substep for which rotations drift
    kicks: Floats  # (n_kicks,) parts of a substep for which moments act
    longest: float  # longest substep times the angular frequency of the barrier, rad
