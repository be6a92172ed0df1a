"""The paper's own results (tests/data/reference) and the scenes that they belong to."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sim.core import Floats, Ints
from sim.scene import Scene
from sim.solvers import Harmonic, LinearRamp, held_dofs
from sim.structure import Lattice, Material, damping_of_ratio, quads

FOLDER = Path(__file__).parents[1] / "data/reference"
BARRIER, CUTOFF = np.deg2rad(-15.0), np.deg2rad(-10.0)
SAMPLES = np.linspace(0.0, 1.0, 200)
NO_DOFS = np.array([], dtype=np.int64)


@cache
def reference(name: str) -> dict[str, Floats]:
    """Arrays of one reference scene."""
    with np.load(FOLDER / f"scene_{name}.npz") as stored:
        return dict(stored)


def paper_lattice() -> Lattice:
    return quads(15, 15, 15.0, 2.25, np.deg2rad(20.0))


def paper_material() -> Material:
    density, shear, bending = 6.18e-9, 1.19, 1.5
    damping = damping_of_ratio(0.0186, density, 15.0, shear, bending)
    return Material(density, 120.0, shear, bending, 1.5, *damping)


def scene_a(directions: tuple[float, ...] = (45.0,), **changes: Any) -> Scene:  # noqa: ANN401
    """Figure 2: corners clamped, centre driven for two periods."""
    lattice = paper_lattice()
    distance = np.linalg.norm(lattice.site - lattice.site[112], axis=1)
    scene = Scene(
        lattice=lattice,
        material=paper_material(),
        barrier=BARRIER,
        cutoff=CUTOFF,
        clamped=held_dofs(np.array([0, 14, 210, 224]), NO_DOFS),
        driven=np.array([112]),
        motions=tuple(Harmonic(4.5, 2.0, angle) for angle in np.deg2rad(directions)),
        weights=np.full(len(directions), 1 / len(directions)),
        duration=1.0,
        frequency=2.0,
        static=False,
        cloak=np.flatnonzero((distance <= 67.5) & (distance > 0)),
        region=np.flatnonzero(distance > 67.5),
    )
    return replace(scene, **changes)


def compressed(name: str) -> Scene:
    """Scenes B and C: left column clamped, right column pushed in by the load parameter, mm."""
    lattice = paper_lattice()
    left = 15 * np.arange(15)
    return Scene(
        lattice=lattice,
        material=paper_material(),
        barrier=BARRIER,
        cutoff=CUTOFF,
        clamped=held_dofs(left, NO_DOFS),
        driven=left + 14,
        motions=(LinearRamp(-1.0, 1.0),),
        weights=np.ones(1),
        duration=float(reference(name)["static_amp_end_mm"]),
        frequency=None,
        static=True,
        cloak=reference(name)["cloak_blocks"].astype(int),
        region=np.arange(lattice.n_units),
        objective="strain_energy",
    )


def group_gradient(scene: Scene, name: str, stem: str) -> Floats:
    """Gradient by the scene's design vector from the reference's, stored by shifts of ligaments."""
    stored, lattice = reference(name), scene.lattice
    by_group = np.full((lattice.n_groups, 2), np.nan)
    for kind in ("horizontal", "vertical"):
        mask = stored[f"mask_{kind}_design"].astype(bool)
        groups = _shift_groups(lattice, kind)[mask]
        by_group[groups] = stored[stem.format(kind)]
    return by_group[scene.space.groups].ravel()


def _shift_groups(lattice: Lattice, kind: str) -> Ints:
    """Design group of each shift of a 15 x 15 lattice, in the reference's layout."""
    group = lattice.group.reshape(15, 15, 4).transpose(1, 0, 2)  # of unit (i, j), vertex
    right, top, left, bottom = np.moveaxis(group, 2, 0)
    if kind == "horizontal":
        return np.concatenate([left, right[-1:]], axis=0)
    return np.concatenate([bottom, top[:, -1:]], axis=1)
