"""Ranks mechanisms that the model leaves out by the share of a residual that each explains.

A small term e(x) added to the energy changes the force over the displacement s of the grips by
de(x(s))/ds along the equilibria x(s) without it, as these are stationary; a drag or friction adds
the power that it takes, over the speed of the grips. Fitted constants take up what they can of such
a change in the tests of the fit; the rest is what the prediction would change by.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pipeline.calibration.experiments import force_displacement
from pipeline.calibration.inputs import Constants, TestKind
from pipeline.problem.sections import Lattice
from sim.core import Floats, Numbers
from sim.energy import ligament_strain
from sim.structure import Parameters

GRAVITY = 9.81e3
"""mm/s^2."""
STEPS = 60


class TestPath(NamedTuple):
    """Holds the equilibria of one specimen and test."""

    length: float  # of the ligaments, mm
    displacement: Floats  # (n,) of the grips from zero on, mm
    force: Floats  # (n,) N
    motion: Floats  # (n, n_units, 3) mm, mm, rad
    stretch: Floats  # (n, n_ligaments) mm
    shear: Floats  # (n, n_ligaments) rad
    bend: Floats  # (n, n_ligaments) rad
    law: Floats  # (n_ligaments, 3) stiffness
    mass: Floats  # (n_units, 3)
    damping: Floats  # (n_units, 3)

    def slope(self, values: Floats) -> Floats:
        """Differentiates values (n, ...) by the displacement."""
        return np.gradient(values, self.displacement, axis=0)

    @property
    def travel(self) -> Floats:
        """(n, n_units) way of each unit over that of the grips, without the turn."""
        return np.asarray(np.linalg.norm(self.slope(self.motion[:, :, :2]), axis=2))


def follow_test(specimen: Lattice, test: TestKind, constants: Constants, end: float) -> TestPath:
    """Finds the equilibria of a test up to a displacement `end`, mm.

    Raises:
        SimulationError: there is none.
    """
    displacement = end * np.arange(1, STEPS + 1) / STEPS
    posed = force_displacement.pose_simulation(specimen, test, constants, displacement)
    force = posed.predict(constants)
    motion = replace(posed, observe=_identity).predict(constants)
    made = posed.parameters(constants.numbers)
    pairs = posed.lattice.ligament_units

    def strains(state: Array) -> tuple[Array, Array, Array]:
        ends = state[pairs]
        arms = made.arm[:, 0], made.arm[:, 1]
        return jax.vmap(ligament_strain)(ends[:, 0], ends[:, 1], *arms, made.vector)

    whole = np.concatenate([np.zeros_like(motion[:1]), motion])
    found = (np.asarray(part) for part in jax.vmap(strains)(jnp.asarray(whole)))
    rest = (np.asarray(part) for part in (made.law, made.mass, made.damping))
    length = specimen.ligament_length
    return TestPath(length, np.r_[0.0, displacement], np.r_[0.0, force], whole, *found, *rest)


def _identity(motion: Numbers, _: Parameters) -> Array:
    return jnp.asarray(motion)


class Mechanism(NamedTuple):
    """Describes physics that the model leaves out: its plausible size, and what it does there."""

    name: str  # in words
    size: str  # in words
    change: Callable[[TestPath], Floats]  # of the force (n,) along a path, N


def _friction(path: TestPath) -> Floats:
    return 0.3 * GRAVITY * (path.mass[:, 0] * path.travel).sum(axis=1)


def _weight(path: TestPath) -> Floats:
    pull = GRAVITY * path.slope(path.motion[:, :, 1] @ path.mass[:, 0])
    return pull - pull[0]


def _viscous_drag(path: TestPath) -> Floats:
    return 1.0 * ((path.slope(path.motion) ** 2) * path.damping).sum(axis=(1, 2))


def _initial_curvature(path: TestPath) -> Floats:
    """Computes the root mean square over random signs: 3 deg at every ligament."""
    each = path.law[:, 2] * np.deg2rad(3.0) * path.slope(path.bend)
    return np.asarray(np.sqrt((each**2).sum(axis=1)))


def _stiffening_bending(path: TestPath) -> Floats:
    """Makes bending stiffer by a tenth at 0.3 rad: k_b (1 + 0.1 (bend / 0.3)^2)."""
    return 0.1 / 0.3**2 * path.slope((path.bend**4) @ path.law[:, 2] / 4)


def _compliant_fixture(path: TestPath) -> Floats:
    """Subtracts the fixture's compliance, 1 um/N, from the specimen's compression."""
    return -1e-3 * path.force * path.slope(path.force)


def _offset_start(path: TestPath) -> Floats:
    return 0.05 * path.slope(path.force)


def _shear_stretch(path: TestPath) -> Floats:
    """Adds a tension of sheared ligaments: k_a (l g^2 / 2)^2 / 2 of a hundredth of k_a."""
    return 0.01 * path.slope((path.shear**4) @ path.law[:, 0] * path.length**2 / 8)


MECHANISMS = (
    Mechanism("friction of the units on a plate", "coefficient 0.3", _friction),
    Mechanism("weight in the plane of the specimen", "hung upright", _weight),
    Mechanism("viscosity", "damping ratio of the paper, 1 mm/s", _viscous_drag),
    Mechanism("shims bent at rest", "3 deg, random sign", _initial_curvature),
    Mechanism("shims stiffer when bent far", "10 % at 0.3 rad", _stiffening_bending),
    Mechanism("stretch of shims sheared far", "1 % of the axial constant", _shear_stretch),
    Mechanism("compliance of slots and fixture", "0.001 mm/N", _compliant_fixture),
    Mechanism("start of the test read late", "0.05 mm, in all tests", _offset_start),
)


class RankedMechanism(NamedTuple):
    """Holds of a mechanism what it changes the prediction by, of either sign where it has none."""

    name: str
    size: str
    change: Floats  # (n,) of the predicted force's logarithm, constants refitted
    explained: float  # part of the residual's root mean square that it takes away, at that size
    alone: float  # the same, if it acted in the predicted test alone
    wanted: float  # factor on the size that takes away most; NaN of none


class FittedSlopes(NamedTuple):
    """Holds derivatives of logarithms of forces by those of the constants."""

    fitted: Sequence[Floats]  # of every test of the fit (n_points, 3), at even displacements
    predicted: Floats  # (n, 3)


def rank_mechanisms(
    fitted: Sequence[TestPath],
    predicted: TestPath,
    slopes: FittedSlopes,
    spread: Floats,
    displacement: Floats,
    residual: Floats,
) -> list[RankedMechanism]:
    """Ranks all mechanisms, the one that explains most first.

    Args:
        fitted: tests of the fit.
        predicted: the other.
        slopes: by which the constants take up a change.
        spread: (3,) of the samples' constants.
        displacement: (n,) of the prediction, mm.
        residual: (n,) logarithm of measured over predicted force.
    """
    other = slopes.predicted @ spread
    found = [_ranked("a stiffer sample", "one standard deviation", other, other, residual)]
    for mechanism in MECHANISMS:
        pairs = zip(fitted, slopes.fitted, strict=True)
        seen = [
            _relative_change(
                mechanism, path, path.displacement[-1] * np.arange(1, len(each) + 1) / len(each)
            )
            for path, each in pairs
        ]
        taken, *_ = np.linalg.lstsq(np.concatenate(slopes.fitted), np.concatenate(seen), rcond=1e-3)
        alone = _relative_change(mechanism, predicted, displacement)
        change = alone - slopes.predicted @ taken
        found.append(_ranked(mechanism.name, mechanism.size, change, alone, residual))
    return sorted(found, key=lambda each: -each.explained)


def _ranked(
    name: str, size: str, change: Floats, alone: Floats, residual: Floats
) -> RankedMechanism:
    signs = (1, -1) if "random sign" in size else (1,)
    explained, only = (
        max(1 - np.linalg.norm(residual - sign * each) / np.linalg.norm(residual) for sign in signs)
        for each in (change, alone)
    )
    square = change @ change
    wanted = residual @ change / square if square > 0 else np.nan
    return RankedMechanism(name, size, change, float(explained), float(only), float(wanted))


def _relative_change(mechanism: Mechanism, path: TestPath, displacement: Floats) -> Floats:
    """Computes changes of the logarithm of a force at displacements in mm."""
    whole = mechanism.change(path)[1:] / path.force[1:]
    return np.interp(displacement, path.displacement[1:], whole)
