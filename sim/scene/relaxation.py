"""Finds the equilibrium of a structure whose ligaments are not free of stress, before any load."""

from dataclasses import replace
from typing import NamedTuple

import jax
import numpy as np

from sim.core import Floats
from sim.energy import RestState, rest_state
from sim.scene.parameter_map import concrete_parameters, rest_motion
from sim.scene.scene import Scene
from sim.scene.simulation import simulate
from sim.structure import arrays_of

_rest_state = jax.jit(rest_state)
"""Compiles all at once: that is sooner done than each operation by itself."""


class Relaxed(NamedTuple):
    """Holds a structure at rest under the stress of its own ligaments."""

    scene: Scene  # the structure as it rests, whose motion is counted from there
    vertices: Floats  # (n_vertices, 2) of its units there, mm
    motion: Floats  # (n_units, 3) from the structure as designed to there, mm, mm, rad


class AsBuilt(NamedTuple):
    """Holds the effect of bent shims on a structure."""

    turn: Floats  # (n_units,) by which units turn as the shims relax before any load, rad
    loss_as_designed: float  # weighted mean over the load cases
    loss_as_built: float  # the same, motion and strain counted from where the structure rests


def relaxed(scene: Scene, vertices: Floats | None = None) -> Relaxed:
    """Lets a structure come to rest, its held units where they are, and counts motion from there.

    The structure as it rests is the same one: units are moved as rigid bodies, and the natural
    state of each ligament is told from its new vector, so that energies and forces agree.
    `Material.end_angles` and `Material.elongation` say how ligaments are bent and stretched;
    `vertices` (n_vertices, 2) are the design's, mm, by default those of the lattice.

    Raises:
        SimulationError: there is no equilibrium.
    """
    network = scene.lattice.vertices if vertices is None else vertices
    values = concrete_parameters(scene, network)
    motion = np.asarray(rest_motion(scene, values))
    rest = _rest_state(arrays_of(scene.lattice), values, motion)
    return Relaxed(_with_rest_state(scene, rest), np.asarray(rest.vertices), motion)


def at_rest(scene: Scene, vertices: Floats) -> tuple[Scene, Floats]:
    """Lets a structure come to rest if its ligaments are under stress, as scene and vertices.

    One without stress is returned as it is; `vertices` (n_vertices, 2) are in mm.

    Raises:
        SimulationError: there is no equilibrium.
    """
    material = scene.structure.material
    if not (np.any(material.end_angles) or np.any(material.elongation)):
        return scene, vertices
    return relaxed(scene, vertices)[:2]


def _with_rest_state(scene: Scene, rest: RestState) -> Scene:
    """Replaces the lattice by the one at rest, and the natural state by what is left of it."""
    stretch, shear, bend = np.asarray(rest.natural).T
    material = scene.structure.material._replace(
        shear_stiffness=np.asarray(rest.shear_stiffness),
        elongation=stretch,
        end_angles=np.stack([shear + bend / 2, shear - bend / 2], axis=1),
    )
    lattice = replace(scene.lattice, vertices=np.asarray(rest.vertices))
    # at rest the lattice is as symmetric as its shims, which a design of it need not know
    return scene.updated(lattice=lattice, material=material, symmetry="none")


def as_built(
    scene: Scene, vertices: Floats, end_angles: Floats, designed_angles: Floats | None = None
) -> AsBuilt:
    """Simulates a structure as designed and as built.

    `vertices` (n_vertices, 2) are the design's, mm; `end_angles` (n_ligaments, 2) those of the
    slots against the ligaments, in the order of the structure's ligaments, rad. A shim is straight
    by itself, and slides in its slots until it is as long as the ligament: it is bent, but not
    stretched. As designed, shims are straight by default.

    Raises:
        SimulationError: a motion cannot be followed to its end.
    """
    designed, corners = scene, vertices
    if designed_angles is not None:
        designed, corners, _ = relaxed(scene.bent(designed_angles), vertices)
    rest = relaxed(scene.bent(end_angles), vertices)
    losses = (
        float(simulate(each, vertices=there).loss)
        for each, there in ((designed, corners), (rest.scene, rest.vertices))
    )
    return AsBuilt(rest.motion[:, 2], *losses)
