"""Paces the finer steps at contact on void angles, which ``contact_substeps.c`` takes."""

from typing import NamedTuple

from sim.core import Floats


class Pace(NamedTuple):
    """Holds the splitting of the finer steps."""

    drifts: Floats  # its coefficients
    kicks: Floats  # its coefficients
    reach: float  # longest finer step times the angular frequency of the barrier
