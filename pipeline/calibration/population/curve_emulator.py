"""Interpolates simulated curves of force over the constants, for samplers that need many.

Equilibria depend on ratios of stiffness alone, so that with the shear constant k_s

    F(u; k_a, k_s, k_b) = k_s u exp(g(u; ln k_a/k_s, ln k_b/k_s)),

and g is smooth: a product of Chebyshev polynomials in the two ratios, and a cubic spline in u.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.polynomial import chebyshev
from scipy.interpolate import make_interp_spline

from pipeline.calibration.experiments import force_displacement
from pipeline.calibration.inputs import ELASTIC_NAMES, Constants, TestKind
from pipeline.problem.sections import Lattice
from sim.core import Floats, Numbers

REACH = ((-2.5, 4.5), (-1.0, 1.0))
"""Of the logarithms of both ratios, about those of the priors' centres."""
ORDERS = (9, 5)
STEPS = 24
"""Loads of a curve."""
TEST_POINTS = 40


class CurveEmulator(NamedTuple):
    """Interpolates the curve of one specimen and test."""

    displacement: Floats  # (STEPS,) mm
    centre: Floats  # (2,) of the logarithms of the ratios
    coefficients: Floats  # (orders + 1, orders + 1, STEPS) of g
    error: float  # largest relative one of the force at other random constants

    def weights(self, displacement: Floats) -> Floats:
        """Returns the coefficients (n, orders + 1, orders + 1) at displacements in mm."""
        spline = make_interp_spline(self.displacement, np.moveaxis(self.coefficients, 2, 0))
        return np.asarray(spline(displacement))


def share_beyond(centre: Numbers, logs: Numbers) -> float:
    """Computes the share of constants whose ratios are beyond REACH, at whose bounds forces stay.

    Args:
        centre: (2,) of the logarithms of the ratios, an emulator's own.
        logs: (..., 3) of the constants.
    """
    low, high = np.array(REACH).T
    ratios = np.asarray(logs)[..., [0, 2]] - np.asarray(logs)[..., 1:2] - np.asarray(centre)
    return float(((ratios < low) | (ratios > high)).any(axis=-1).mean())


def log_force(weights: Numbers, centre: Numbers, base: Numbers, logs: Numbers) -> Array:
    """Computes logarithms (..., n) of forces in N, at each order k by cos(k arccos x).

    Args:
        weights: (n, orders + 1, orders + 1) of the emulator.
        centre: (2,) its own.
        base: (n,) logarithms of the displacements in mm.
        logs: (..., 3) of the constants.
    """
    at = jnp.asarray(logs)
    ratios = at[..., jnp.array([0, 2])] - at[..., 1:2]
    low, high = np.array(REACH).T
    place = (2 * (ratios - centre) - (low + high)) / (high - low)
    angle = jnp.arccos(jnp.clip(place, -1 + 1e-9, 1 - 1e-9))
    first, second = (jnp.cos(angle[..., k, None] * np.arange(ORDERS[k] + 1)) for k in range(2))
    return jnp.einsum("...a,...b,nab->...n", first, second, weights) + at[..., 1:2] + base


def emulate(
    specimen: Lattice, test: TestKind, centre: Constants, end: float, seed: int = 0
) -> CurveEmulator:
    """Simulates a test at Chebyshev's nodes up to a displacement `end`, mm, and at random places.

    Raises:
        SimulationError: a specimen within reach has no equilibrium.
    """
    displacement = end * np.arange(1, STEPS + 1) / STEPS
    simulation = force_displacement.pose_simulation(specimen, test, centre, displacement)
    middle = centre.logs(ELASTIC_NAMES)
    ratios = middle[[0, 2]] - middle[1]

    def scaled(place: Floats) -> Floats:
        low, high = np.array(REACH).T
        x, y = ratios + (low + high) / 2 + place * (high - low) / 2
        force = simulation.predict(centre.at(ELASTIC_NAMES, np.array([x, 0.0, y])))
        return np.asarray(np.log(force / displacement))

    nodes = [chebyshev.chebpts1(order + 1) for order in ORDERS]
    values = np.array([[scaled(np.array([x, y])) for y in nodes[1]] for x in nodes[0]])
    inverses = [
        np.linalg.inv(chebyshev.chebvander(node, order))
        for node, order in zip(nodes, ORDERS, strict=True)
    ]
    coefficients = np.einsum("ai,bj,ijn->abn", *inverses, values)
    trials = np.random.default_rng(seed).uniform(-1, 1, (TEST_POINTS, 2))
    found = [chebyshev.chebval2d(place[0], place[1], coefficients) for place in trials]
    wrong = np.abs(np.array(found) - [scaled(place) for place in trials]).max()
    return CurveEmulator(displacement, ratios, coefficients, float(np.expm1(wrong)))
