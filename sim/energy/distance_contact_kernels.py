"""Compiles contact of units on their distance: energy, gradient, tangent, mixed derivatives.

Derived by hand from sim/energy/distance_contact.py and tested against its automatic derivatives.
Units are rigid,
so each term is a function of where its vertex v lies in the frame of the other unit b: with g its
gradient by v, r_a and r_b the arms of v from the two centroids, and J a quarter turn,

    dE/d(u_a, theta_a, u_b, theta_b) = (g, J r_a . g, -g, -J r_b . g).

The term of an edge is a function of the vertex's distance s outside its line and its position x
along it; with t and n the edge's direction and outer normal g = E_s n + E_x t.
"""

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
