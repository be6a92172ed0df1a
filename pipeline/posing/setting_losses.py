"""Simulates the losses of the altered structure and of a design in one problem."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import xarray as xr
from pydantic import ValidationError

from pipeline.posing.case_result import PosedStructure, structures_of
from pipeline.posing.structure_variables import of_problem
from pipeline.posing.to_scene import scene_of
from pipeline.problem import Problem, canonical_json, from_canonical
from pipeline.problem.reading import find_faults, first_fault
from pipeline.problem.sections import Setting, SettingError, apply_setting
from pipeline.runtime import SweepResult, UserError
from sim.core import Floats, SimulationError
from sim.scene import cases_of, make_plan, mimicking, target_motion
from sim.solvers import Outcome, Solved, run_batch

Result = Outcome[tuple[float, float]]


class UnposedError(ValueError):
    """Refuses a setting that makes no problem that could be simulated."""


def results(
    asked: Problem, setting: Setting, folder: Path, design: xr.Dataset, threads: int
) -> tuple[list[SweepResult], tuple[float, ...]]:
    """Simulates every load case of a problem, its files in `folder`, with a setting laid over it.

    Also returns the weights of the load cases, which add up to 1.

    Raises:
        UnposedError: the setting makes no problem, or one that the design does not fit.
        SimulationError: what the structures should mimic cannot be simulated.
    """
    with _refused():
        problem = posed(asked, setting)
        if not of_problem(problem, design):
            raise UnposedError("the design is of another lattice, or lacks units of this one")
        # No design space is asked for: its symmetry costs more than it could save.
        scene = scene_of(problem, folder).updated(symmetry="none")
    target = None if scene.objective.reference is None else target_motion(scene, threads)
    with _refused():
        structures = structures_of(scene, design)
    altered, cloaked = (
        _simulated(structures[name], target, threads) for name in ("altered", "cloaked")
    )
    found = [_found(*pair) for pair in zip(altered, cloaked, strict=True)]
    return found, problem.drive.case_weights


@contextmanager
def _refused() -> Iterator[None]:
    """Refuses a setting for the reason for which its problem is."""
    try:
        yield
    except ValidationError as error:
        raise UnposedError(first_fault(error)[0]) from error
    except UserError as error:
        raise UnposedError(error.what) from error
    except SettingError as error:
        raise UnposedError(str(error)) from error


def mean(found: list[SweepResult], weights: Sequence[float]) -> SweepResult:
    """Joins several load cases into one: their losses weighted, their smallest void angle."""
    numbers = np.array([each[:-1] for each in found])
    loss, altered = np.asarray(weights) @ numbers[:, :2]
    status = next((each.status for each in found if each.status != "ok"), "ok")
    return SweepResult(float(loss), float(altered), float(numbers[:, 2].min()), status)


def posed(asked: Problem, setting: Setting) -> Problem:
    """Lays a setting over a problem's own values, and drops the sweep."""
    data = json.loads(canonical_json(asked, "sweep"))
    if any(key.startswith("material.foil") for key in setting):
        data.get("fabrication", {}).get("shims", {}).pop("thickness", None)  # follows from the foil
    data = apply_setting(data, setting)
    data.pop("sweep", None)
    problem = from_canonical(data)
    for finding in find_faults(problem):
        raise UnposedError(f"{'.'.join(map(str, finding.keys))}: {finding.what}")
    return problem


def _found(altered: Result, cloaked: Result) -> SweepResult:
    nothing = (float("nan"), float("nan"))
    loss, void = cloaked.value or nothing
    failures = (cloaked.failure, altered.failure and f"altered structure: {altered.failure}")
    status = next((failure for failure in failures if failure), "ok")
    return SweepResult(loss, (altered.value or nothing)[0], void, status)


def _simulated(structure: PosedStructure, target: Floats | None, threads: int) -> Iterator[Result]:
    """Simulates loss and smallest void angle of a structure in each load case."""
    scene, vertices = structure
    try:
        plan = make_plan(scene, vertices, threads=threads, gradient=False)
    except SimulationError as error:
        return iter([Outcome(None, str(error), error)] * len(scene.loads.motions))

    def reduce(solved: Solved) -> tuple[float, float]:
        number = solved.case.number
        measure = mimicking(scene, None if target is None else target[number : number + 1])
        loss = float(measure(solved.displacement[None], solved.case.values)[0])
        voids = scene.topology.smallest_void_angle(solved.case.values.void, solved.displacement)
        return loss, float(voids.min())

    cases = cases_of(scene, vertices, plan.solver, plan.simulated)
    solved = list(run_batch(cases, reduce, threads))
    return (solved[k] for k in np.searchsorted(plan.simulated, plan.case_of))
