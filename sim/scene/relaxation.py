"""Finds the equilibrium of a structure whose ligaments are not free of stress, before any load."""

from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sim.core import Floats
from sim.energy import ligament_strain
from sim.scene.scene import Scene
from sim.scene.simulation import Response, mimicking, simulate
from sim.solvers import LinearRamp
from sim.structure import Parameters


class Relaxed(NamedTuple):
    """Holds a structure at rest under the stress of its own ligaments.

    Attributes:
        scene: the structure as it rests, whose motion is counted from there.
        vertices: (n_vertices, 2) of its units there, mm.
        motion: (n_units, 3) from the structure as designed to there, mm, mm, rad.
    """

    scene: Scene
    vertices: Floats
    motion: Floats


class AsBuilt(NamedTuple):
    """Tells what bent shims make of a structure.

    Attributes:
        turn: (n_units,) by which units turn as the shims relax before any load, rad.
        loss_as_designed: weighted mean over the load cases.
        loss_as_built: the same, the motion counted from where the structure rests; of a loss that
            is a strain energy, less that at rest.
    """

    turn: Floats
    loss_as_designed: float
    loss_as_built: float


def relaxed(scene: Scene, vertices: Floats | None = None) -> Relaxed:
    """Lets a structure come to rest, its held units where they are, and counts motion from there.

    The structure as it rests is the same one: units are moved as rigid bodies, and the natural
    state of each ligament is told from its new vector, so that energies and forces agree.

    Args:
        scene: the scene; `Material.end_angles` and `Material.elongation` say how ligaments are
            bent and stretched.
        vertices: (n_vertices, 2) of the design, mm; by default those of the lattice.

    Raises:
        SimulationError: there is no equilibrium.
    """
    still = scene.loads.following(LinearRamp(0.0, 1.0, 0.0))
    posed = scene.updated(cases=(still,), weights=None, static=True, duration=1.0, reference=None)
    network = scene.lattice.vertices if vertices is None else vertices
    found = simulate(posed, vertices=network, times=np.ones(1))
    motion, values = np.asarray(found.displacement[0, -1]), found.parameters
    turn, unit = motion[:, 2][scene.lattice.unit], scene.lattice.unit
    arm, cosine, sine = values.corner, np.cos(turn), np.sin(turn)
    turned = np.stack(
        [cosine * arm[:, 0] - sine * arm[:, 1], sine * arm[:, 0] + cosine * arm[:, 1]], axis=1
    )
    moved = values.centroid[unit] + motion[unit, :2] + turned
    return Relaxed(_counted_from(scene, moved, values, motion), moved, motion)


def _counted_from(scene: Scene, moved: Floats, values: Parameters[Floats], motion: Floats) -> Scene:
    """Replaces the lattice by the one moved, and the natural state by what is left of it."""
    lattice = replace(scene.lattice, vertices=moved)
    ends = motion[scene.lattice.ligament_units]
    given = (ends[:, 0], ends[:, 1], values.arm[:, 0], values.arm[:, 1], values.vector)
    strain = jax.vmap(ligament_strain)(*(jnp.asarray(part) for part in given))
    stretch, shear, bend = (
        natural - np.asarray(part) for natural, part in zip(values.natural.T, strain, strict=True)
    )
    before, after = (np.linalg.norm(v, axis=1) for v in (values.vector, lattice.ligament_vectors))
    material = scene.structure.material._replace(
        # k_s (l0 gamma)^2 knows the length as designed
        shear_stiffness=values.law[:, 1] * (before / after) ** 2,
        elongation=stretch,
        end_angles=np.stack([shear + bend / 2, shear - bend / 2], axis=1),
    )
    # at rest the lattice is as symmetric as its shims, which a design of it need not know
    return scene.updated(lattice=lattice, material=material, symmetry="none")


def as_built(scene: Scene, vertices: Floats, end_angles: Floats) -> AsBuilt:
    """Simulates a structure as designed and as built.

    Args:
        scene: as designed, with its load cases and its loss.
        vertices: (n_vertices, 2) of the design, mm.
        end_angles: (n_ligaments, 2) of the slots against the ligaments, in the order of the
            structure's ligaments, rad. A shim is straight by itself, and slides in its slots until
            it is as long as the ligament: it is bent, but not stretched.

    Raises:
        SimulationError: a motion cannot be followed to its end.
    """
    designed = simulate(scene, vertices=vertices)
    material = scene.structure.material._replace(end_angles=end_angles)
    rest = relaxed(scene.updated(material=material), vertices)
    built = simulate(rest.scene, vertices=rest.vertices)
    loss = float(built.loss) - _at_rest(built)
    return AsBuilt(rest.motion[:, 2], float(designed.loss), loss)


def _at_rest(built: Response) -> float:
    """Computes the loss of no motion at all, where that is a strain energy; zero of others."""
    scene = built.scene
    if scene.objective.kind != "strain_energy" or scene.objective.reference is not None:
        return 0.0
    still = np.zeros_like(built.displacement)
    energies = np.asarray(mimicking(scene)(still, built.parameters))
    return float(energies[0])
