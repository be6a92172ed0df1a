"""Computes contact of units on their distance: energy, gradient, tangent, mixed derivatives."""

from sim.collision import ContactArrays
from sim.core import Floats, Ints, compiled
from sim.energy.network_arrays import Kinematics, Sensitivity
from sim.linalg import Matrix


@compiled
def add_gradient(motion: Floats, contacts: ContactArrays, out: Floats) -> float:
    """Adds the energy gradient to ``out`` (n_dofs,); returns the energy, infinite on overlap."""


@compiled
def add_tangent(motion: Floats, contacts: ContactArrays, free: Ints, matrix: Matrix) -> None:
    """Adds the Hessian among the free dofs to a matrix (as ``kernels.tangent``)."""


@compiled
def add_hessian_product(
    motion: Floats, contacts: ContactArrays, direction: Floats, out: Floats
) -> None:
    """Adds the Hessian times ``direction`` to ``out`` (n_dofs,), over all dofs."""


@compiled
def add_mixed(
    motion: Floats, contacts: ContactArrays, kinematics: Kinematics, direction: Floats,
    out: Sensitivity,
) -> None:  # fmt: skip
    """Adds d/dp of (``direction`` . dE/dmotion), p the arms, centroids and contact stiffnesses."""
