"""Poses the paper's scenes at their initial designs."""

from collections import Counter
from functools import cache
from typing import Any

import numpy as np

from benchmarks.scenes.paper_constants import DAMPING_RATIO, MATERIAL, SPACING
from pipeline.posing import scene_of
from pipeline.problem.reading import load
from pipeline.runtime import ROOT
from sim.core import Floats
from sim.quasistatics import static_solver
from sim.scene import (
    Clamp,
    Design,
    Loads,
    Objective,
    Scene,
    StrainEnergyMimicking,
    Structure,
    concrete_parameters,
)
from sim.solvers import LinearRamp, PrescribedMotion, Solver, TanhRamp, solve_case
from sim.structure import damping_of_ratio, quads
from sim.time_integration import explicit, implicit

HEAVY = MATERIAL._replace(density=1.0, damping_translation=0.0, damping_rotation=0.0)
"""The paper's material for statics: density 1 tonne/mm^2 where it is moved at all."""
PUSH = 14.999907837380967
"""Final displacement of the driven column, mm: the last value of the authors' ramp to 15 mm."""


def fig2(**changes: Any) -> Scene:  # noqa: ANN401  (fields of a scene)
    """Poses Figure 2 as the authors ran it, four load angles, without symmetry unless asked for."""
    problem = ROOT / "experiments/fig2/problem.yaml"
    scene = scene_of(load(problem), problem.parent)
    plain: dict[str, Any] = {"symmetry": "none", "accuracy": "default", "integrator": "auto"}
    return scene.updated(**{**plain, **changes})


def one_case(scene: Scene, degrees: float) -> Scene:
    """Keeps the load case of that direction alone."""
    angles = [getattr(motion, "direction", np.nan) for motion in scene.loads.motions]
    return scene.alone(int(np.flatnonzero(np.isclose(angles, np.deg2rad(degrees)))[0]))


@cache
def fig4() -> Scene:
    """Poses Figure 4's setting: pushed by a column, the region in the middle spared of strain.

    Radii as in the paper's text: region 3 spacings, cloak up to 5. One load: the final one.
    """
    lattice = quads(15, 15, 15.0, 2.25, np.deg2rad(20.0))
    distance = np.linalg.norm(lattice.site - lattice.site[112], axis=1)
    left = 15 * np.arange(15)
    return Scene(
        Structure(lattice, HEAVY),
        Loads((PrescribedMotion(left + 14, LinearRamp(-PUSH, 1.0)),), (Clamp(left),), static=True),
        Objective(np.flatnonzero(distance <= 45.0 + 1e-9), "strain_energy"),
        Design(np.flatnonzero((distance > 45.0 + 1e-9) & (distance <= 75.0 + 1e-9))),
    )


def fig4_as_dynamics() -> Scene:
    """Poses it as the authors solve it: density 1 tonne/mm^2, damped, pushed over 3500 s."""
    scene, duration = fig4(), 3500.0
    shear, bending = (
        float(np.mean(each)) for each in (HEAVY.shear_stiffness, HEAVY.bending_stiffness)
    )
    damping = damping_of_ratio(DAMPING_RATIO, 1.0, SPACING, shear, bending)
    material = HEAVY._replace(damping_translation=damping[0], damping_rotation=damping[1])
    drive = TanhRamp(-15.0, duration)
    return scene.driven_by(drive, material=material, duration=duration, static=False)


def final_energy(scene: Scene) -> StrainEnergyMimicking:
    """Returns the strain energy of the region in the last state, N mm."""
    ligaments = scene.region_ligaments
    units = scene.lattice.ligament_units[ligaments]
    return StrainEnergyMimicking(ligaments, units, np.ones(1))


def counted(scene: Scene, solver: Solver, cases: list[int]) -> dict[str, int]:
    """Counts the work of the forward solves of some load cases at the initial design."""
    values = concrete_parameters(scene, scene.lattice.vertices)
    records = (solve_case(solver, values, scene.loads.cases[case])[2] for case in cases)
    return dict(sum((Counter(work_of(record)) for record in records), Counter()))


def work_of(record: object) -> dict[str, int]:
    """Counts the work of the forward solve of one case."""
    match record:
        case explicit.ExplicitRecord():
            n_steps, n_kicks, _ = record.steps.drive.shape
            return {"steps": n_steps, "forces": n_steps * n_kicks}
        case static_solver.StaticRecord():
            forces, factorisations, _, increments = (int(count) for count in record.counts)
            return {"increments": increments, "forces": forces, "factorisations": factorisations}
        case implicit.ImplicitRecord():
            forces, factorisations, _ = (int(count) for count in record.counts)
            n_steps = len(record.times) - 1
            return {"steps": n_steps, "forces": forces, "factorisations": factorisations}
    raise TypeError(f"a solver's record, not {type(record).__name__}")


def by_variable(scene: Scene, stored: dict[str, Floats]) -> Floats:
    """Orders the authors' gradient (n_variables,), stored by shifts of ligaments.

    Shift (i, j) of the horizontal ones moves the ligament between units (i - 1, j) and (i, j), of
    the vertical ones that between (i, j - 1) and (i, j).
    """
    lattice = scene.lattice
    right, top, left, bottom = lattice.group.reshape(15, 15, 4).transpose(2, 1, 0)
    groups = {
        "horizontal": np.concatenate([left, right[-1:]], axis=0),
        "vertical": np.concatenate([bottom, top[:, -1:]], axis=1),
    }
    gradient = np.full((lattice.n_groups, 2), np.nan)
    for kind, of_shift in groups.items():
        free = stored[f"mask_{kind}_design"].astype(bool)
        gradient[of_shift[free]] = stored[f"grad_{kind}_shifts_rk4_discrete"]
    return gradient[scene.space.groups].ravel()
