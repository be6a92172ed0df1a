"""Specimens as they come out: shapes, places, stiffnesses and damping off by the tolerances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.problem.sections import Tolerances
from sim.core import Floats
from sim.scene import Scene
from sim.structure import (
    LARGEST_FACTOR,
    Material,
    PerturbedStructure,
    assembled,
    shifted,
    stiffened,
)


def drawn(
    scene: Scene, vertices: Floats, asked: Tolerances, seed: Sequence[int]
) -> tuple[Scene, PerturbedStructure]:
    """One specimen of a structure: the scene with its constants, and its vertices.

    Args:
        scene: of the structure as designed.
        vertices: (n_vertices, 2) of the design, mm.
        asked: how far things may be off.
        seed: equal seeds give equal specimens, whatever else is drawn.
    """
    random = np.random.default_rng(seed)
    lattice = scene.lattice
    copy = shifted(
        lattice, vertices, asked.geometry * lattice.spacing, scene.structure.contact, random
    )
    material = stiffened(scene.structure.material, lattice.n_ligaments, asked.ligaments, random)
    axial, shear, bending = _factors(3, asked.stiffness, random)
    damping = _factors(lattice.n_units, asked.units, random) * _factors(1, asked.damping, random)
    constants: Material = material._replace(
        axial=material.axial * axial,
        shear=material.shear * shear,
        bending=material.bending * bending,
        damping_translation=material.damping_translation * damping,
        damping_rotation=material.damping_rotation * damping,
    )
    joints = np.random.default_rng((*seed, 1))
    spread = (asked.assembly.shift, asked.assembly.turn)
    return scene.updated(material=constants), assembled(
        lattice, copy, spread, scene.structure.contact, joints
    )


def _factors(count: int, deviation: float, random: np.random.Generator) -> Floats:
    """Factors (count,) about one, normal, none below a tenth."""
    draws = np.clip(random.standard_normal(count), -LARGEST_FACTOR, LARGEST_FACTOR)
    return np.maximum(1.0 + deviation * draws, 0.1)
