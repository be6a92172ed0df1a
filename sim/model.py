"""What a solve works on: the parameters it can be differentiated by, and the fixed topology."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, NamedTuple, TypeAlias, TypeVar

import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.arrays import Floats, Ints, Numbers
from sim.geometry import Shape
from sim.lattice import Lattice
from sim.matrix import Pattern, number_free_dofs
from sim.meeting import Meeting, meeting_units
from sim.network import Network

A = TypeVar("A")


class Material(NamedTuple):
    """Constants of a specimen, each a number or an array over ligaments or units.

    Attributes:
        density: areal density, tonne/mm^2.
        axial, shear: ligament stiffness, N/mm.
        bending: ligament stiffness, N mm/rad.
        contact: contact stiffness, N mm/rad^2.
        damping_translation: to ground, per unit, tonne/s.
        damping_rotation: to ground, per unit, tonne mm^2/s.
    """

    density: float | Numbers
    axial: float | Numbers
    shear: float | Numbers
    bending: float | Numbers
    contact: float | Numbers
    damping_translation: float | Numbers
    damping_rotation: float | Numbers


class Parameters(NamedTuple, Generic[A]):
    """All that a response depends on differentiably, besides the drive.

    Attributes:
        arm: (n_ligaments, 2, 2) arms of both ends, mm.
        vector: (n_ligaments, 2) reference ligament vectors, mm.
        void: (n_ligaments, 2) reference void angles, rad.
        law: (n_ligaments, 3) axial, shear, bending stiffness.
        contact: (n_ligaments,) contact stiffness, N mm/rad^2.
        corner: (n_vertices, 2) arms of all vertices, mm.
        centroid: (n_units, 2) mm.
        mass: (n_units, 3) tonne, tonne, tonne mm^2.
        damping: (n_units, 3) tonne/s, tonne/s, tonne mm^2/s.
    """

    arm: A
    vector: A
    void: A
    law: A
    contact: A
    corner: A
    centroid: A
    mass: A
    damping: A


Values: TypeAlias = Parameters[Floats]
"""Concrete parameters, as the solvers take them."""


def damping_of_ratio(
    ratio: float, density: float, spacing: float, shear: float, bending: float
) -> tuple[float, float]:
    """Damping constants (tonne/s, tonne mm^2/s) as the authors derive them from one damping ratio.

    They take the critical damping of one unrotated unit (diagonal 0.85 spacings) on one hinge.
    """
    area, polar_moment = 0.36125 * spacing**2, 0.02175026 * spacing**4
    return (
        2 * ratio * (density * area * shear) ** 0.5,
        2 * ratio * (density * polar_moment * bending) ** 0.5,
    )


def parameters(lattice: Lattice, shape: Shape, material: Material) -> Parameters[Array]:
    """Parameters of a network of the given shape; differentiable in shape and material."""
    n = lattice.n_ligaments
    stiffness = (material.axial, material.shear, material.bending)
    mass, inertia = material.density * shape.area, material.density * shape.polar_moment
    damping = (
        material.damping_translation,
        material.damping_translation,
        material.damping_rotation,
    )
    return Parameters(
        arm=shape.arm[lattice.ligaments],
        vector=jnp.asarray(lattice.ligament_vectors),
        void=shape.void_angle,
        law=jnp.stack([jnp.broadcast_to(k, (n,)) for k in stiffness], axis=1),
        contact=jnp.broadcast_to(jnp.asarray(material.contact, dtype=float), (n,)),
        corner=shape.arm,
        centroid=shape.centroid,
        mass=jnp.stack([mass, mass, inertia], axis=1),
        damping=jnp.stack([jnp.broadcast_to(c, (lattice.n_units,)) for c in damping], axis=1),
    )


@dataclass(frozen=True)
class Topology:
    """What stays fixed while parameters and drives change.

    Attributes:
        ligament_units: (n_ligaments, 2).
        site: (n_units, 2) where the units are, mm.
        held: (n_held,) ids (3 unit + dof) of the prescribed dofs, ascending.
        barrier, cutoff: contact angles, rad.
        designed: (n_designed,) ligaments whose parameters may be differentiated by.
        rotation_scale: length that makes rotations comparable with displacements, mm.
        meeting: the units that may meet, if contact acts on their distance; without it contact
            acts on the void angles.
    """

    ligament_units: Ints
    site: Floats
    held: Ints
    barrier: float
    cutoff: float
    designed: Ints
    rotation_scale: float
    meeting: Meeting | None = None

    @cached_property
    def numbering(self) -> tuple[Ints, Pattern]:
        """Number of each dof among the free ones (-1 if held), and the tangent's pattern."""
        coupled = self.ligament_units
        if self.meeting is not None:
            coupled = np.concatenate([coupled, self.meeting.pairs])
        return number_free_dofs(self.site, coupled, self.held)

    @cached_property
    def free_dofs(self) -> Ints:
        """(n_free,) ids of the free dofs in the tangent's order."""
        number = self.numbering[0]
        return np.argsort(np.where(number < 0, len(number), number), kind="stable")[: self.n_free]

    def coupling(self, pairs: Ints) -> Topology:
        """The same with room in the tangent for contact of more pairs (n, 2) of units."""
        assert self.meeting is not None
        return replace(self, meeting=self.meeting.with_pairs(pairs))

    @property
    def n_units(self) -> int:
        """Number of units."""
        return len(self.site)

    @property
    def n_dofs(self) -> int:
        """Number of all dofs."""
        return 3 * self.n_units

    @property
    def n_free(self) -> int:
        """Number of free dofs."""
        return self.n_dofs - len(self.held)

    def network(self, values: Values, touching: Ints | None = None) -> Network:
        """The kernels' arrays of concrete parameters, with contact in ``touching`` ligaments.

        If contact acts on the distance of units, there is none in any ligament.
        """
        n = len(self.ligament_units)
        if self.meeting is not None:
            touching = np.zeros(0, dtype=np.int64)
        contact = np.empty((n, 3))
        contact[:, 0] = values.contact
        by_angle = self.meeting is None
        contact[:, 1], contact[:, 2] = (
            (self.barrier, self.cutoff) if by_angle else (-np.inf, -np.inf)
        )
        return Network(
            unit=self.ligament_units,
            arm=np.array(values.arm, dtype=float, order="C"),
            vector=np.array(values.vector, dtype=float, order="C"),
            void=np.array(values.void, dtype=float, order="C"),
            law=np.array(values.law, dtype=float, order="C"),
            contact=contact,
            touching=np.arange(n) if touching is None else touching,
        )

    @cached_property
    def scale(self) -> Floats:
        """(n_dofs,) weights that make displacements and rotations comparable, mm."""
        return np.tile([1.0, 1.0, self.rotation_scale], self.n_units)

    def smallest_void_angle(self, void: Floats, motion: Floats) -> Floats:
        """Smallest void angle (...) of states ``motion`` (..., n_units, 3), rad."""
        return self.smallest_void_angles(void, motion).min(axis=-1)

    def smallest_void_angles(self, void: Floats, motion: Floats) -> Floats:
        """Smaller void angle (..., n_ligaments) of each ligament, rad."""
        a, b = self.ligament_units.T
        turned = motion[..., a, 2] - motion[..., b, 2]
        return np.minimum(void[:, 0] + turned, void[:, 1] - turned)


def topology(
    lattice: Lattice,
    held: Ints,
    barrier: float,
    cutoff: float,
    designed_units: Ints | None = None,
    distance: float | None = None,
) -> Topology:
    """Topology of a lattice whose dofs ``held`` are prescribed.

    With a ``distance`` (mm), contact acts on units nearer than that to one another.

    Without ``designed_units`` every ligament's parameters can be differentiated by; with them only
    those of the ligaments of these units, which must be all units with a vertex that the design
    moves (a moved vertex shifts the centroid, and with it every arm of its unit).
    """
    units = lattice.ligament_units
    designed = (
        np.arange(len(units))
        if designed_units is None
        else np.flatnonzero(np.isin(units, designed_units).any(axis=1))
    )
    return Topology(
        ligament_units=np.ascontiguousarray(units),
        site=lattice.site,
        held=np.unique(held),
        barrier=barrier,
        cutoff=cutoff,
        designed=designed,
        rotation_scale=lattice.spacing / 2,
        meeting=None if distance is None else meeting_units(lattice, distance),
    )
