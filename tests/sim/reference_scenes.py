"""The paper's own results (tests/data/reference) and the scenes that they belong to."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sim.core import Floats, Ints
from sim.scene import Clamp, Design, Loads, Objective, Scene, Structure
from sim.solvers import Harmonic, LinearRamp, PrescribedMotion
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
    shaken = (Harmonic(4.5, 2.0, angle) for angle in np.deg2rad(directions))
    scene = Scene(
        Structure(lattice, paper_material()),
        Loads(
            tuple(PrescribedMotion(np.array([112]), motion) for motion in shaken),
            (Clamp(np.array([0, 14, 210, 224])),),
        ),
        Objective(region=np.flatnonzero(distance > 67.5)),
        Design(cloak=np.flatnonzero((distance <= 67.5) & (distance > 0))),
    )
    return scene.updated(**changes)


def compressed(name: str) -> Scene:
    """Scenes B and C: left column clamped, right column pushed in by the load parameter, mm."""
    lattice = paper_lattice()
    left = 15 * np.arange(15)
    return Scene(
        Structure(lattice, paper_material()),
        Loads(
            (PrescribedMotion(left + 14, LinearRamp(-1.0, 1.0)),),
            (Clamp(left),),
            duration=float(reference(name)["static_amp_end_mm"]),
            static=True,
        ),
        Objective(region=np.arange(lattice.n_units), kind="strain_energy"),
        Design(cloak=reference(name)["cloak_blocks"].astype(int)),
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
