"""Loops over the ligaments: energy, gradient, tangent and mixed derivatives.

Second derivatives read the kinematics that ``gradient`` or ``locate`` left of the same state.
"""

from sim.core import Floats, Ints, compiled
from sim.energy.network_arrays import Kinematics, NetworkArrays, Sensitivity


@compiled
def locate(motion: Floats, net: NetworkArrays, kinematics: Kinematics) -> None:
    """Fills the kinematics of a state, as the second derivatives read them."""


@compiled
def gradient(motion: Floats, net: NetworkArrays, kinematics: Kinematics, out: Floats) -> float:
    """Fills the energy gradient ``out`` (3 n_units,), and the kinematics.

    Returns:
        the strain energy, N mm.
    """


@compiled
def largest_strains(
    motion: Floats, net: NetworkArrays, kinematics: Kinematics, out: Floats
) -> None:
    """Fills ``out`` (3,) with the largest magnitudes of `LigamentStrain`, stretches over lengths.

    All are zero without ligaments, and no numbers where the motion is none.
    """


@compiled
def tangent(
    motion: Floats, net: NetworkArrays, kinematics: Kinematics, entries: Ints, values: Floats
) -> None:
    """Adds the energy's Hessian among the free dofs to the values of a matrix.

    ``entries`` (n_ligaments, 21) are the places of each ligament's block (``block_entries``).
    """


@compiled
def hessian_product(
    motion: Floats, net: NetworkArrays, kinematics: Kinematics, direction: Floats, out: Floats
) -> None:
    """Fills ``out`` (3 n_units,) with the Hessian times ``direction``, over all dofs."""


@compiled
def mixed(
    motion: Floats,
    net: NetworkArrays,
    kinematics: Kinematics,
    direction: Floats,
    which: Ints,
    out: Sensitivity,
    n_which: int = 0,
) -> None:
    """Adds d/dp of (``direction`` . dE/dmotion) to ``out`` for the ligaments in ``which``."""
