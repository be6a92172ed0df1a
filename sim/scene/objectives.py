"""Measures how far a response is from its target, per load case, in JAX."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.core import Floats, Ints, Numbers
from sim.energy import LigamentLaw, ligament_energy
from sim.structure import Parameters

CHANGE = 2.0
"""Error of a motion over its change at half the steps."""


class DisplacementMimicking(NamedTuple):
    """Sums weighted |U|^2 over samples and units, U = (ux/s, uy/s, theta) (Eq. 1, target rest)."""

    units: Ints  # (n,) region of interest
    spacing: float  # s, mm
    weights: Floats  # (n_times,) quadrature weights

    def __call__(self, displacement: Numbers, parameters: Parameters[Any]) -> Array:
        """Losses (n_cases,) of displacements (n_cases, n_times, n_units, 3)."""
        del parameters
        normalised = displacement[:, :, self.units] / scales(self.spacing)
        return jnp.einsum("ctud,ctud,t->c", normalised, normalised, self.weights)


class RelativeMimicking(NamedTuple):
    """Takes the root of the weighted sum of |U - U_target|^2, over the size of U_target (Eq. 1)."""

    units: Ints  # (n,) region of interest
    spacing: float  # s, mm
    weights: Floats  # (n_times,) quadrature weights
    target: Numbers  # (n_cases, n_times, n, 3) displacement to mimic, mm, mm, rad
    size: Numbers  # (n_cases,) what counts as 1

    def __call__(self, displacement: Numbers, parameters: Parameters[Any]) -> Array:
        """Losses (n_cases,) of displacements (n_cases, n_times, n_units, 3).

        Raises:
            ValueError: the motion to mimic is of other load cases, times or units.
        """
        del parameters
        region = displacement[:, :, self.units]
        if region.shape != self.target.shape:
            raise ValueError(
                f"the motion to mimic is of {self.target.shape[:3]} load cases, times and units,"
                f" the structure's of {region.shape[:3]}; give the reference the scene's cases,"
                " steps and region"
            )
        missed = (region - self.target) / scales(self.spacing)
        return jnp.sqrt(jnp.einsum("ctud,ctud,t->c", missed, missed, self.weights)) / self.size


class ReactionMimicking(NamedTuple):
    """Adds the relative error of the drive's force to that of the motion.

    The force is what the ligaments of the driven units carry to the others: contact on void angles
    turns units and pushes none. Contact on distance may push driven units, and is not counted.
    """

    motion: RelativeMimicking  # error of the motion
    weight: float  # of the force's error in the sum
    ligaments: Ints  # (n,) that join a driven unit to one that is not, in any case
    ligament_units: Ints  # (n, 2) units that they join
    # (n_cases, n) 1 where the case drives the first of both alone, -1 the second alone, else 0
    sign: Ints
    target: Numbers  # (n_cases, n_times, 2) force to mimic, N
    size: Numbers  # (n_cases,) what counts as 1, N

    def __call__(self, displacement: Numbers, parameters: Parameters[Any]) -> Array:
        """Losses (n_cases,) of displacements (n_cases, n_times, n_units, 3)."""
        missed = self.force(displacement, parameters) - self.target
        squares = jnp.einsum("ctd,ctd,t->c", missed, missed, self.motion.weights)
        return self.motion(displacement, parameters) + self.weight * jnp.sqrt(squares) / self.size

    def force(self, displacement: Numbers, parameters: Parameters[Any]) -> Array:
        """Sums the drive's force (n_cases, n_times, 2), N, in (n_cases, n_times, n_units, 3)."""
        return jnp.einsum(
            "ctld,cl->ctd", self._ligament_forces(displacement, parameters), self.sign
        )

    def carried(self, displacement: Numbers, parameters: Parameters[Any]) -> Array:
        """Sums (n_cases, n_times) the magnitudes of the ligaments' forces in states, N."""
        each = jnp.linalg.norm(self._ligament_forces(displacement, parameters), axis=3)
        return jnp.einsum("ctl,cl->ct", each, np.abs(self.sign))

    def _ligament_forces(self, displacement: Numbers, parameters: Parameters[Any]) -> Array:
        """Forces (n_cases, n_times, n, 2) at the first ends of the ligaments, N."""
        ends = jnp.asarray(displacement)[..., self.ligament_units, :]
        arm, vector = parameters.arm[self.ligaments], parameters.vector[self.ligaments]
        law, natural = LigamentLaw(*parameters.law[self.ligaments].T), parameters.natural
        flat = ends.reshape(-1, *ends.shape[-3:])
        pulls = _end_forces(
            flat[:, :, 0], flat[:, :, 1], arm[:, 0], arm[:, 1], vector, law, natural[self.ligaments]
        )
        return pulls[..., :2].reshape(*ends.shape[:3], 2)


def combined(losses: Numbers, weights: Numbers, sharpness: float) -> Array:
    """Takes the weighted p-mean of losses (n_cases,): their mean for 1, the largest for large p."""
    if sharpness == 1.0:
        return jnp.asarray(weights) @ jnp.asarray(losses)
    largest = jax.lax.stop_gradient(jnp.max(losses))
    return p_mean(losses, largest, jnp.asarray(weights), sharpness)


def p_mean(values: Numbers, largest: Numbers, weights: Numbers, sharpness: float) -> Array:
    """Takes the weighted p-mean of values, scaled by the largest; 0 with no slope if that is 0."""
    some = largest > 0.0
    total = weights @ (values / jnp.where(some, largest, 1.0)) ** sharpness
    return jnp.asarray(largest) * jnp.where(some, total, 1.0) ** (1.0 / sharpness)


def scales(spacing: float) -> Floats:
    """Returns divisors (3,) of ux, uy (mm) and theta (rad) that make them comparable."""
    return np.array([spacing, spacing, 1.0])


def extent(motion: Numbers, spacing: float) -> Any:  # noqa: ANN401  (arrays as those given)
    """Computes the size |U| (n_cases, n_times) of a region's motion (n_cases, n_times, n, 3)."""
    norm = np.linalg.norm if isinstance(motion, np.ndarray) else jnp.linalg.norm
    return norm(motion / scales(spacing), axis=(2, 3))


def estimated_errors(
    motions: tuple[Floats, Floats], losses: tuple[float, float], size: float
) -> tuple[float, float]:
    """Estimates the errors of a region's motion and of its loss by a solution with half the steps.

    A motion that starts with a jump converges with the first power of the steps or less: its error
    is about twice what changes. The change of a loss may happen to vanish; what is quadratic in
    that of the motion is left then. Motions, in comparable units, and losses are as solved and with
    half the steps; `size` is that of a loss, whose error is relative to it.

    Returns:
        the error of the motion, root mean square, relative to it; that of the loss.
    """
    motion = CHANGE * _relative(np.linalg.norm(motions[0] - motions[1]), np.linalg.norm(motions[1]))
    loss = CHANGE * _relative(abs(losses[0] - losses[1]), size)
    return motion, max(loss, motion**2 * _relative(abs(losses[1]), size))


def _relative(change: float | np.floating, size: float | np.floating) -> float:
    """Divides; nothing changes where nothing moves."""
    return 0.0 if change == 0.0 else float(change / size) if size else float("inf")


class StrainEnergyMimicking(NamedTuple):
    """Sums weighted over samples the region's strain energy, without contact, N mm (Eq. 2).

    Strains are counted from the start of the motion: a stress at rest is none of the load's.
    """

    ligaments: Ints  # (n,) ligaments that touch the region
    ligament_units: Ints  # (n, 2) units that they join
    weights: Floats  # (n_times,) quadrature weights

    def __call__(self, displacement: Numbers, parameters: Parameters[Any]) -> Array:
        """Losses (n_cases,) of displacements (n_cases, n_times, n_units, 3)."""
        from_rest = parameters._replace(natural=jnp.zeros_like(parameters.natural))
        energies = strain_energies(displacement, from_rest, self.ligaments, self.ligament_units)
        return jnp.einsum("ctl,t->c", energies, self.weights)


def strain_energies(
    displacement: Numbers, parameters: Parameters[Any], ligaments: Ints, ligament_units: Ints
) -> Array:
    """Computes the strain energy (..., n) of ligaments (n,) in states (..., n_units, 3), N mm."""
    whole = jnp.asarray(displacement)
    first, second = (whole[..., ligament_units[:, end], :] for end in range(2))
    arm, vector = parameters.arm[ligaments], parameters.vector[ligaments]
    law, natural = LigamentLaw(*parameters.law[ligaments].T), parameters.natural[ligaments]
    ends = (values.reshape(-1, *values.shape[-2:]) for values in (first, second))
    flat = _energies(*ends, arm[:, 0], arm[:, 1], vector, law, natural)
    return flat.reshape(first.shape[:-1])


_end_forces = jax.jit(jax.vmap(jax.vmap(jax.grad(ligament_energy)), in_axes=(0, 0, *(None,) * 5)))
"""Derivatives (n_states, n, 3) of their energies by the motion of the first end's unit."""

_energies = jax.jit(jax.vmap(jax.vmap(ligament_energy), in_axes=(0, 0, *(None,) * 5)))
"""Energies (n_states, n) of the ligaments between units in states (n_states, n, 3)."""
