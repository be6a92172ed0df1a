"""Static studies with a motion in closed form, written as their stages would.

The lattice is squeezed along x; its rows draw in by as much as the structure's `draw`, its units
turn in turns by `turn` at full load; the void's units are absent where they are.
"""

from pathlib import Path
from typing import Any, cast

import numpy as np
import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.datasets.tables import TABLES, Kind
from pipeline.posing import (
    lattice_of,
    law_comparison,
    network_variables,
    scene_of,
    spread,
    unit_coordinates,
)
from pipeline.posing.perturbed import noises
from pipeline.posing.to_scene import altered_lattice_of
from pipeline.problem import Output, Problem
from pipeline.runtime import REPORTED
from pipeline.stages.verify import variants
from reports.study import StudyResults, study_results
from sim.structure import Lattice
from tests.pipeline import static, unchanged
from tests.pipeline.samples import filled

ROBUSTNESS = "robustness: { samples: 5 }\n"
PAPER = (
    'report: { snapshots: [0 mm, 6 mm, 12 mm, 15 mm], paper: { figure: "4", variant: as run,'
    " strain: 0.1, values: { rotation_reduction: 64 % } } }\n"
)
SHIELD = static.SHIELD + ROBUSTNESS + PAPER
SMILE = static.SMILE + ROBUSTNESS

TURN = {"intact": 0.25, "altered": 0.2, "cloaked": 0.02}
DRAW = {"intact": 20.0, "altered": 8.0, "cloaked": 19.0}
FORCE = {"intact": 13.0, "altered": 5.0, "cloaked": 12.0}
LOSS = {"intact": 0.0, "altered": 0.92, "cloaked": 0.05}


def written(folder: Path, more: str) -> StudyResults:
    """The study with its datasets in `folder`, read back."""
    path = static.write(folder, more)
    chosen = problem.load(path)
    made: dict[Output, xr.Dataset] = {
        "design": design(chosen, path),
        "response": response(chosen, path),
        "scatter": scatter(chosen),
        "verification": verification(chosen),
        "geometric_design": design(chosen, path),
        "geometric_response": response(chosen, path),
    }
    files: dict[Output, Path] = {}
    for kind in problem.outputs(chosen):
        files[kind] = folder / f"{kind}.nc"
        stage = REPORTED[kind]
        plan: dict[str, object] = {name: {"skipped": []} for name in names(chosen)}
        again = kind == "geometric_response"
        posed = law_comparison.under(chosen, "geometric") if again else chosen
        about = provenance.of_study(posed, stage.name, plan=plan)
        datasets.write(made[kind], files[kind], cast(Kind, stage.kind), about)
    return study_results.load(path, None, files)


def names(chosen: Problem) -> list[str]:
    return [*(["intact"] if chosen.objective.target == "intact" else []), "altered", "cloaked"]


def _lattices(chosen: Problem) -> dict[str, Lattice]:
    altered = altered_lattice_of(chosen)
    return {name: lattice_of(chosen) if name == "intact" else altered for name in names(chosen)}


def design(chosen: Problem, path: Path) -> xr.Dataset:
    margins = {"constraint_margin": ("constraint", np.array([0.0, 0.01, 2e-9]))}
    made = unchanged.design(chosen, path.parent, _history() | margins)
    return made.assign_coords(
        method=list(chosen.optimiser.methods.chosen),
        constraint=["edge_length", "block_angle", "void_angle"],
        constraint_units=("constraint", ["mm", "rad", "rad"]),
    )


def _history() -> dict[str, Any]:
    """Six evaluations by one method, the third rejected."""
    step = np.arange(6)
    loss = 0.92 * np.exp(-0.6 * step)
    loss[3] = 0.8
    per_evaluation = ("method", "evaluation")
    return {
        "evaluation": step,
        "loss": (per_evaluation, loss[None]),
        "loss_case": ((*per_evaluation, "case"), loss[None, :, None]),
        "violation": (per_evaluation, np.zeros((1, 6))),
        "accepted": (per_evaluation, (step != 3)[None].astype("int8")),
        "design_vector": ((*per_evaluation, "variable"), np.zeros((1, 6, 2))),
        "best_evaluation": ("method", [5]),
        "best_loss": ("method", loss[5:]),
        "kkt_residual": ("method", [0.01]),
    }


def response(chosen: Problem, path: Path) -> xr.Dataset:
    whole, time = lattice_of(chosen), np.linspace(0.0, 1.0, chosen.response.samples)
    lattices, scene = _lattices(chosen), scene_of(chosen, path.parent)
    variables = network_variables(chosen, scene)
    motion = np.stack(
        [
            spread(_motion(chosen, lattice, time, name), lattice, whole.n_units, axis=1)[None]
            for name, lattice in lattices.items()
        ]
    )
    driven = variables["support"][1] == 2
    force = np.full(motion.shape, np.nan)
    for k, name in enumerate(lattices):
        force[k, :, :, driven] = 0.0
        force[k, 0, :, driven, 0] = -FORCE[name] * time / driven.sum()
    sizes = dict(zip(("structure", "case", "time", "unit", "dof"), motion.shape, strict=True))
    sizes |= {"xy": 2, "contact_law": 2, "snap_number": 1, "traced_point": 1}
    absent = ("snap", "snap_load", "loss_other_branch", "traced_load", "traced_eigenvalue")
    nothing = dict.fromkeys((*absent, "traced_force"), np.nan)
    drive = np.zeros((1, len(time), 2))
    drive[0, :, 0] = -_amplitude(chosen) * time
    loss = np.array([[LOSS[name]] for name in lattices])
    shapes = [spread(each.padded(each.vertices), each, whole.n_units) for each in lattices.values()]
    return xr.Dataset(
        filled("response", sizes, 0.01, 1, velocity=0.0, **nothing)
        | variables
        | {
            "vertices": (("structure", "unit", "vertex", "xy"), np.stack(shapes)),
            "displacement": (TABLES["response"]["displacement"].dims, motion),
            "reaction_force": (TABLES["response"]["reaction_force"].dims, force),
            "drive_displacement": (("case", "time", "xy"), drive),
            "loss": (("structure", "case"), loss),
        },
        unit_coordinates(whole)
        | {
            "structure": list(lattices),
            "direction": ("case", [180.0]),
            "frequency": ("case", [np.nan]),
            "amplitude": ("case", [_amplitude(chosen)]),
            "time": time,
            "dof": ["ux", "uy", "theta"],
            "contact_law": ["angle", "geometric"],
        },
    )


def _amplitude(chosen: Problem) -> float:
    return float(chosen.drive.amplitude)  # type: ignore[union-attr]


def _motion(chosen: Problem, lattice: Lattice, time: np.ndarray, name: str) -> np.ndarray:
    """Displacement (time, unit, 3) in mm, mm, rad."""
    across, up = (lattice.site / lattice_of(chosen).site.max(axis=0)).T
    waist = np.sin(np.pi * across)
    sign = np.where(lattice.index.sum(axis=1) % 2 == 0, 1.0, -1.0)
    form = np.column_stack(
        [-_amplitude(chosen) * across, (0.5 - up) * DRAW[name] * waist, sign * waist * TURN[name]]
    )
    return time[:, None, None] * form


def scatter(chosen: Problem) -> xr.Dataset:
    assert chosen.robustness is not None
    kinds = noises(chosen.robustness, 15.0)
    size, steps = (len(kinds), chosen.robustness.samples), chosen.horizon.steps or 1
    time = np.arange(1, steps + 1) / steps
    reach = 0.01 * (1 + np.arange(size[1]) + np.arange(size[0])[:, None])
    status = np.full(size, "ok", dtype=object)
    status[1, 2] = "no equilibrium found beyond load 3 of 4"
    rotation = np.where((status == "ok")[..., None], reach[..., None] * time, np.nan)
    copy, cases = ("noise", "sample"), len(chosen.drive.case_weights)
    return xr.Dataset(
        {
            "rotation": ((*copy, "time"), rotation),
            "departure": ((*copy, "case", "time"), np.stack([rotation] * cases, axis=2)),
            "reaction": ((*copy, "time"), 12.0 + rotation),
            "loss": (copy, rotation[..., -1]),
            "min_void_angle": (copy, rotation[..., -1]),
            "clashes": (copy, (reach > 0.04).astype(int)),
            "redrawn": (copy, (reach > 0.04).astype(int)),
            "status": (copy, status),
        },
        {"noise": [kind.name for kind in kinds], "sample": np.arange(size[1]), "time": time},
    )


def verification(chosen: Problem) -> xr.Dataset:
    checks, structures = list(variants(chosen)), names(chosen)
    variables = filled("verification", {"check": len(checks), "structure": len(structures)}, 0.05)
    status = np.array(["ok"] * (len(checks) - 1) + ["no equilibrium found"])
    labels = {"check": checks, "structure": structures}
    return xr.Dataset(variables | {"status": ("check", status)}, labels)
