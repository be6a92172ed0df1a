"""Lists the datasets that stages make of a problem, and poses it over measured constants."""

from pathlib import Path
from typing import Literal

from pipeline.problem.fields import csv_columns, units
from pipeline.problem.model import Problem
from pipeline.problem.sections import ListedNetwork, Sweep, write_quantity
from pipeline.runtime import UserError

Output = Literal[
    "design",
    "response",
    "built",
    "sweep",
    "constants",
    "scatter",
    "verification",
    "geometric_design",
    "geometric_response",
]


def outputs(problem: Problem) -> tuple[Output, ...]:
    """The datasets of a problem that its report shows: those of the sections that it has."""
    by_angle = problem.static and problem.contact.law == "angle"
    wave = not problem.static and problem.objective.target == "intact"
    asked: dict[Output, bool] = {
        "design": True,
        "response": True,
        "built": problem.report.as_built,
        "sweep": problem.sweep is not None,
        "constants": problem.report.measured_constants is not None,
        "scatter": problem.robustness is not None,
        "verification": problem.horizon.steps is not None or wave,
        "geometric_design": by_angle,
        "geometric_response": by_angle,
    }
    return tuple(name for name, wanted in asked.items() if wanted)


_DIMENSIONS = {
    "axial_stiffness": units.STIFFNESS,
    "shear_stiffness": units.STIFFNESS,
    "bending_stiffness": units.BENDING_STIFFNESS,
}


def check_measured_constants(asked: Problem, folder: Path) -> None:
    """Reads the measured constants that a problem names, if it names any.

    Raises:
        UserError: their file cannot be used.
    """
    if asked.report.measured_constants is None:
        return
    try:
        over_measured_constants(asked, folder)
    except UserError as error:
        error.key = error.key or "report.measured_constants.file"
        raise


def over_measured_constants(asked: Problem, folder: Path) -> Problem:
    """Replaces the sweep of a problem by one over the measured constants that its report names.

    They take the place of those that follow from a foil.

    Raises:
        UserError: the file cannot be used, or has fewer draws than are asked for.
    """
    named = asked.report.measured_constants
    assert named is not None
    if isinstance(asked.lattice, ListedNetwork) and asked.lattice.stiffnesses is not None:
        what = "the lattice's file tells the stiffnesses of its ligaments"
        key, remedy = "report.measured_constants", "leave the one or the other out"
        raise UserError(what, file=folder / asked.lattice.file, key=key, remedy=remedy)
    path = folder / named.file
    drawn = csv_columns.read_quantities(path, _DIMENSIONS, named.samples)
    if not (drawn > 0).all():
        name = list(_DIMENSIONS)[int(drawn.min(axis=0).argmin())]
        remedy = "delete the draws that have none"
        raise UserError("a stiffness is not positive", file=path, key=name, remedy=remedy)
    last = max(named.samples - 1, 1)
    chosen = drawn[[round(k * (len(drawn) - 1) / last) for k in range(named.samples)]]
    listed = {
        f"material.{name}": tuple(
            write_quantity(float(value), dimension.unit) for value in chosen[:, k]
        )
        for k, (name, dimension) in enumerate(_DIMENSIONS.items())
    }
    material = asked.material.model_copy(update={"foil": None})
    sweep = Sweep.model_validate({"list": listed})
    return asked.model_copy(update={"material": material, "sweep": sweep})
