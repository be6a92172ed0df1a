"""Holds what stays fixed while parameters and drives change: joints and held dofs."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from sim.collision import CandidatePairs, find_candidate_pairs
from sim.core import Floats, Ints
from sim.energy.network_arrays import NetworkArrays
from sim.linalg import PINNED, Pattern, Storage, block_entries, number_free_dofs
from sim.structure import (
    ConcreteParameters,
    ContactModel,
    DistanceContact,
    Lattice,
    VoidAngleContact,
)


@dataclass(frozen=True)
class Topology:
    """Holds what stays fixed while parameters and drives change."""

    ligament_units: Ints  # (n_ligaments, 2)
    site: Floats  # (n_units, 2) where the units are, mm
    # (n_held,) ids (3 unit + dof) of the prescribed dofs, ascending; those of the loads are
    # numbered after all units'
    held: Ints
    designed: Ints  # (n_designed,) ligaments whose parameters may be differentiated by
    rotation_scale: float  # length that makes rotations comparable with displacements, mm
    contact: VoidAngleContact | CandidatePairs  # law, or what the law on distances acts on
    loaded: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))  # (n_loaded,) units
    storages: tuple[Storage, ...] = PINNED  # of the tangent, to choose from

    @cached_property
    def numbering(self) -> tuple[Ints, Pattern]:
        """Number of each dof among the free ones (-1 if held), and the tangent's pattern."""
        free, pattern = number_free_dofs(
            self.site, self.coupled_units, self.unloaded.held, self.storages
        )
        return np.append(free, np.full(3 * len(self.loaded), -1)), pattern

    @cached_property
    def entries(self) -> Ints:
        """(n_ligaments, 21) where the ligaments' blocks lie in the tangent (`block_entries`)."""
        free, pattern = self.numbering
        return block_entries(pattern, free, self.ligament_units)

    @property
    def unloaded(self) -> Topology:
        """Returns the structure whose loads are no coordinates."""
        if len(self.loaded) == 0:
            return self
        held = self.held[: len(self.held) - 3 * len(self.loaded)]
        return replace(self, held=held, loaded=self.loaded[:0])

    @property
    def coupled_units(self) -> Ints:
        """(n, 2) pairs of units that the tangent couples."""
        if isinstance(self.contact, VoidAngleContact):
            return self.ligament_units
        return np.concatenate([self.ligament_units, self.contact.pairs])

    @cached_property
    def free_dofs(self) -> Ints:
        """(n_free,) ids of the free dofs in the tangent's order."""
        number = self.numbering[0]
        return np.argsort(np.where(number < 0, len(number), number), kind="stable")[: self.n_free]

    def coupling(self, pairs: Ints) -> Topology:
        """Makes room in the tangent for contact of more pairs (n, 2) of units."""
        assert isinstance(self.contact, CandidatePairs)
        return replace(self, contact=self.contact.with_pairs(pairs))

    @property
    def n_units(self) -> int:
        """Number of units."""
        return len(self.site)

    @property
    def n_dofs(self) -> int:
        """Number of all dofs, those of the loads included."""
        return 3 * (self.n_units + len(self.loaded))

    @property
    def n_free(self) -> int:
        """Number of free dofs."""
        return self.n_dofs - len(self.held)

    def network(self, values: ConcreteParameters, touching: Ints | None = None) -> NetworkArrays:
        """Lays out the kernels' arrays of parameters, with contact in ``touching`` ligaments.

        If contact acts on the distance of units, there is none in any ligament.
        """
        n, law = len(self.ligament_units), self.contact
        contact = np.full((n, 3), -np.inf)
        contact[:, 0] = values.contact
        if isinstance(law, VoidAngleContact):
            contact[:, 1:] = law.barrier_angle, law.cutoff_angle
        else:
            touching = np.zeros(0, dtype=np.int64)
        return NetworkArrays(
            unit=self.ligament_units,
            arm=np.array(values.arm, dtype=float, order="C"),
            vector=np.array(values.vector, dtype=float, order="C"),
            void=np.array(values.void, dtype=float, order="C"),
            law=np.array(values.law, dtype=float, order="C"),
            natural=np.array(values.natural, dtype=float, order="C"),
            contact=contact,
            touching=np.arange(n) if touching is None else touching,
        )

    @cached_property
    def scale(self) -> Floats:
        """(n_dofs,) weights that make displacements and rotations comparable, mm.

        A load of 1 N counts as 1 mm.
        """
        of_unit, of_load = ([1.0, 1.0, r] for r in (self.rotation_scale, 1 / self.rotation_scale))
        return np.append(np.tile(of_unit, self.n_units), np.tile(of_load, len(self.loaded)))

    def smallest_void_angle(self, void: Floats, motion: Floats) -> Floats:
        """Computes the smallest void angle (...) of states ``motion`` (..., n_units, 3), rad."""
        return self.smallest_void_angles(void, motion).min(axis=-1)

    def smallest_void_angles(self, void: Floats, motion: Floats) -> Floats:
        """Computes the smaller void angle (..., n_ligaments) of each ligament, rad."""
        a, b = self.ligament_units.T
        turned = motion[..., a, 2] - motion[..., b, 2]
        return np.minimum(void[:, 0] + turned, void[:, 1] - turned)

    def closest_void_angles(self, void: Floats, motion: Floats) -> Floats:
        """Finds the smallest void angle (n_ligaments,) in states (n_states, n_units, 3), rad."""
        turn = np.ascontiguousarray(motion[..., 2].T)
        a, b = self.ligament_units.T
        turned = turn[a] - turn[b]
        return np.minimum(void[:, 0] + turned.min(axis=1), void[:, 1] - turned.max(axis=1))


def topology(
    lattice: Lattice,
    held: Ints,
    contact: ContactModel,
    designed_units: Ints | None = None,
    loaded: Ints | None = None,
) -> Topology:
    """Joins the units of a lattice whose dofs ``held`` are prescribed, and which are ``loaded``.

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
    under = np.zeros(0, dtype=np.int64) if loaded is None else np.unique(loaded)
    loads = 3 * lattice.n_units + np.arange(3 * len(under))
    return Topology(
        ligament_units=np.ascontiguousarray(units),
        site=lattice.site,
        held=np.append(np.unique(held), loads),
        designed=designed,
        rotation_scale=lattice.spacing / 2,
        contact=find_candidate_pairs(lattice, contact.distance)
        if isinstance(contact, DistanceContact)
        else contact,
        loaded=under,
    )
