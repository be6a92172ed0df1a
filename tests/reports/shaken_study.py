"""Datasets of the committed study with a motion in closed form, written as its stages would.

The motion is that of an elastic sheet pulled at its centre: displacement falls off as a logarithm
with the distance, neighbours counter-rotate, everything swings in phase with the drive.
"""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.posing import network_variables, scene_of, unit_coordinates
from pipeline.problem import Output, Problem
from pipeline.problem.sections import HarmonicDrive, sweep_cases
from pipeline.runtime import SweepResult
from pipeline.stages import sweep as sweep_stage
from reports.study import StudyResults, study_results
from sim.structure import Lattice
from tests.pipeline import unchanged
from tests.pipeline.samples import filled
from tests.reports import compressed_study

PROBLEM = Path(__file__).parents[2] / "experiments" / "fig2" / "problem.yaml"

KINDS: tuple[Output, ...] = ("design", "response", "sweep", "scatter")

REACH = {"altered": 1.0, "cloaked": 0.12}
"""Amplitude of the surroundings of each structure, of what the sheet would do."""

LOSS_ERROR, SAMPLES = 3e-5, 0.995
ABSENT = (
    "reaction_force", "snap", "eigenvalue", "snap_load", "traced_load", "traced_force",
    "traced_eigenvalue", "loss_other_branch",
)  # fmt: skip
KKT = {"sqp": 2e-4, "mma": 3e-2}


WARNED = "units that hang on one ligament: 1, the first at [2, 1]"


def written(folder: Path, preset: str | None = None) -> StudyResults:
    """The study with the datasets in `folder`, read back."""
    paths = write(folder, preset)
    files = dict(zip(KINDS, paths, strict=True))
    chosen = problem.load(PROBLEM, preset)
    if chosen.report.measured_constants is not None:
        posed = problem.over_measured_constants(chosen, PROBLEM.parent)
        files["constants"] = folder / "constants.nc"
        about = provenance.of_study(posed, "sweep")
        datasets.write(constants(posed), files["constants"], "sweep", about)
    if chosen.report.as_built:
        files["built"] = folder / "built.nc"
        about = provenance.of_study(chosen, "as_built", plan={})
        built = datasets.read(files["response"], "response")
        datasets.write(built, files["built"], "response", about)
    return study_results.load(PROBLEM, preset, files)


def constants(posed: Problem) -> xr.Dataset:
    assert posed.sweep is not None
    cases = list(enumerate(sweep_cases.list_settings(posed.sweep)))
    found = {number: SweepResult(0.1 + 1e-3 * number, 1.0, 0.5) for number, _ in cases}
    return sweep_stage.dataset(posed, cases, found)


def write(folder: Path, preset: str | None = None) -> list[Path]:
    """Write the datasets of all kinds; returns their paths."""
    chosen = problem.load(PROBLEM, preset)
    lattice = chosen.lattice.network()
    paths = [folder / f"{kind}.nc" for kind in KINDS]
    about = provenance.of_study(chosen, "design")
    datasets.write(design(chosen, lattice), paths[0], "design", about)
    shared = ["simulation of the unloaded reference: it is zero"]
    plan = {
        "altered": {"integrator": "implicit", "skipped": [*shared, "2 of 4 load cases"]},
        "cloaked": {"integrator": "implicit", "skipped": shared, "warnings": [WARNED]},
    }
    about = provenance.of_study(chosen, "simulate", parents={"design": paths[0]}, plan=plan)
    datasets.write(response(chosen, lattice), paths[1], "response", about)
    datasets.write(sweep(chosen), paths[2], "sweep", provenance.of_study(chosen, "sweep"))
    about = provenance.of_study(chosen, "monte_carlo")
    datasets.write(compressed_study.scatter(chosen), paths[3], "scatter", about)
    return paths


def _drive(chosen: Problem) -> HarmonicDrive:
    assert isinstance(chosen.drive, HarmonicDrive)
    return chosen.drive


def cloaked(chosen: Problem, lattice: Lattice) -> np.ndarray:
    """Vertices of a four-fold symmetric design: a harder turn of the units around the source."""
    ends = lattice.vertices[lattice.ligaments].mean(axis=1) - np.array(chosen.lattice.centre_site)
    assert chosen.cloak.disc is not None
    away = np.linalg.norm(ends, axis=1) / chosen.cloak.disc.radius
    strength = np.where(away < 0.98, np.sin(np.pi * away) * (away - 0.4) * 3.0, 0.0)
    turn = strength[:, None] * np.stack([-ends[:, 1], ends[:, 0]], axis=1)
    turn /= np.maximum(np.linalg.norm(ends, axis=1), 1.0)[:, None]
    moved = lattice.vertices.copy()
    for column in range(2):
        moved[lattice.ligaments[:, column]] += turn
    return moved


def design(chosen: Problem, lattice: Lattice) -> xr.Dataset:
    margins = {"constraint_margin": ("constraint", np.array([0.0, 0.01, 2e-9, 0.3, 0.11]))}
    vertices = lattice.padded(cloaked(chosen, lattice))
    made = unchanged.design(chosen, PROBLEM.parent, _histories(chosen) | margins, vertices)
    return made.assign_coords(
        method=["sqp", "mma"],
        constraint=["edge_length", "block_angle", "void_angle", "convexity", "gap"],
        constraint_units=("constraint", ["mm", "rad", "rad", "rad", "mm"]),
    )


def _histories(chosen: Problem) -> dict[str, Any]:
    rng = np.random.default_rng(0)
    counts = [method.evaluations for method in chosen.optimiser.methods.chosen.values()]
    step = np.arange(max(counts))
    loss = np.stack(
        [0.05 + 2.104 * np.exp(-(step**0.6) / 1.6), 0.19 + 1.964 * np.exp(-(step**0.7) / 4.0)]
    )
    loss[1, counts[1] :] = np.nan
    accepted = np.isfinite(loss) & (rng.random(loss.shape) > 0.15)
    accepted[:, 0] = True
    loss = np.where(accepted, loss, 1.6 * loss)
    violation = np.where(np.isnan(loss), np.nan, 0.0)
    violation[1, 4 : counts[1] // 2] = 0.02
    spread = 1.0 + 0.12 * np.cos(np.pi * np.arange(len(_drive(chosen).directions)))
    feasible = np.where(accepted & (violation <= 0), loss, np.inf)
    shared = ("method", "evaluation")
    return {
        "evaluation": step,
        "loss": (shared, loss),
        "loss_case": ((*shared, "case"), loss[..., None] * spread),
        "violation": (shared, violation),
        "accepted": (shared, accepted.astype("int8")),
        "design_vector": ((*shared, "variable"), np.zeros((*loss.shape, 4))),
        "best_evaluation": ("method", feasible.argmin(axis=1)),
        "best_loss": ("method", feasible.min(axis=1)),
        "kkt_residual": ("method", np.array(list(KKT.values()))),
    }


def response(chosen: Problem, lattice: Lattice) -> xr.Dataset:
    assert chosen.response is not None
    frequency = _drive(chosen).frequency
    time = np.linspace(0.0, chosen.response.cycles / frequency, chosen.response.samples)
    motion = np.stack([_motion(chosen, lattice, time, reach) for reach in REACH.values()])
    network = network_variables(chosen, scene_of(chosen, PROBLEM.parent))
    roi = network["roi"][1].astype(bool)
    scaled = motion[..., roi, :] / np.array([lattice.spacing, lattice.spacing, 1.0])
    horizon = time <= chosen.horizon_time * (1 + 1e-9)
    power = (scaled**2).sum(axis=(-1, -2))[..., horizon]
    loss = np.trapezoid(power, time[horizon], axis=-1) / time[horizon][-1]
    per_time, per_case = ("structure", "case", "time"), ("structure", "case")
    per_law = ("structure", "contact_law", "case")
    shapes = [lattice.padded(lattice.vertices), lattice.padded(cloaked(chosen, lattice))]
    n_cases = len(_drive(chosen).directions)
    sizes = dict(zip((*per_time, "unit", "dof"), motion.shape, strict=True))
    sizes |= {"xy": 2, "contact_law": 2, "snap_number": 1, "traced_point": 1}
    constants: dict[str, Any] = dict.fromkeys(("gap", "min_gap", "gap_by_contact"), 0.08)
    constants |= {"stability": -1, "loss_error": LOSS_ERROR, "displacement_error": 2e-3}
    constants |= dict.fromkeys(ABSENT, np.nan)
    return xr.Dataset(
        filled("response", sizes, **constants)
        | network
        | {
            "vertices": (("structure", "unit", "vertex", "xy"), np.stack(shapes)),
            "displacement": ((*per_time, "unit", "dof"), motion),
            "velocity": ((*per_time, "unit", "dof"), np.gradient(motion, time, axis=2)),
            "min_void_angle": (per_time, np.zeros(motion.shape[:3]) + 0.2 - 0.1 * time),
            "loss": (per_case, loss),
            "loss_samples": (per_case, SAMPLES * loss),
            "loss_by_contact": (per_law, np.stack([loss, loss], axis=1)),
        },
        unit_coordinates(lattice)
        | {
            "direction": ("case", np.degrees(_drive(chosen).directions)),
            "structure": ["altered", "cloaked"],
            "time": time,
            "dof": ["ux", "uy", "theta"],
            "contact_law": ["angle", "geometric"],
            "frequency": ("case", np.full(n_cases, frequency)),
            "amplitude": ("case", np.full(n_cases, _drive(chosen).amplitude)),
        },
    )


def _motion(chosen: Problem, lattice: Lattice, time: np.ndarray, reach: float) -> np.ndarray:
    """Displacement (case, time, unit, 3) in mm, mm, rad."""
    away = lattice.site - np.array(chosen.lattice.centre_site)
    radius = np.linalg.norm(away, axis=1)
    spacing, amplitude = lattice.spacing, _drive(chosen).amplitude
    share = np.clip(1 - np.log1p(radius / spacing) / np.log1p(radius.max() / spacing), 0.0, 1.0)
    share = np.where(radius < 1e-9, 1.0, reach * share)
    sign = np.where(lattice.index.sum(axis=1) % 2 == 0, 1.0, -1.0)
    swing = np.sin(2 * np.pi * _drive(chosen).frequency * time)[:, None]
    cases = []
    for direction in _drive(chosen).directions:
        pull = np.array([np.cos(direction), np.sin(direction)])
        turn = sign * share * (away @ pull) / np.maximum(radius, 1.0) * 0.35
        turn = np.where(radius < 1e-9, 0.0, turn)
        form = np.column_stack([amplitude * share * pull[0], amplitude * share * pull[1], turn])
        cases.append(swing[..., None] * form)
    return np.stack(cases)


def sweep(chosen: Problem) -> xr.Dataset:
    assert chosen.sweep is not None
    cases = list(sweep_cases.list_settings(chosen.sweep))
    words = np.array([[str(case[key]) for key in chosen.sweep.keys] for case in cases])
    value = np.array([[float(word.split()[0]) for word in row] for row in words])
    direction, frequency = value.T
    wave = 1.0 + 0.25 * np.cos(4 * np.radians(direction))
    loss = 0.05 + 0.06 * ((frequency - 2) / 14) ** 2 * wave
    both = ("case", "parameter")
    return xr.Dataset(
        {
            "value": (both, value),
            "setting": (both, words),
            "loss": ("case", loss),
            "loss_altered": ("case", 20.0 * loss),
            "status": ("case", np.full(loss.shape, "ok")),
            "min_void_angle": ("case", np.full(loss.shape, -0.1)),
        },
        {
            "case": np.arange(len(cases)),
            "parameter": list(chosen.sweep.keys),
            "parameter_units": ("parameter", ["deg", "Hz"]),
        },
    )
