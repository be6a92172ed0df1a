"""Defines the two laws of contact between units; the stiffness is a constant of the material."""

from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True)
class VoidAngleContact:
    """Lets joined units touch where the void between them closes (the authors' law).

    Attributes:
        barrier_angle: void angle at which the energy is infinite, rad.
        cutoff_angle: void angle above which there is no contact, rad.
    """

    barrier_angle: float
    cutoff_angle: float


@dataclass(frozen=True)
class DistanceContact:
    """Lets any two units touch where their outlines come near each other.

    Attributes:
        distance: activation distance, beyond which there is no contact, mm.
    """

    distance: float


ContactModel: TypeAlias = VoidAngleContact | DistanceContact
