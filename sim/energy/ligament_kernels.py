"""Compiles loops over the ligaments: energy, gradient, tangent and mixed derivatives.

Derived by hand from sim/energy/ligament.py and tested against its automatic derivatives. With d the
current ligament vector, n and t its unit tangent and normal, L its length, gamma its shear angle,

    dW/dd = k_l (L - l0) n + k_s l0^2 gamma t / L,
    dW/dtheta = -k_s l0^2 gamma / 2 -+ k_theta kappa,

each strain taken from its natural value (zero but where a ligament is not free of stress at rest),
and the motions of the two units enter through

    d = vector + (u_b + R_b r_b - r_b) - (u_a + R_a r_a - r_a).

Second derivatives read the kinematics that ``gradient`` or ``locate`` left of the same state: sines
and arctangents are two thirds of their cost.
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
