"""Assembles the dataset of a study's responses from the results of structures and cases."""

from collections.abc import Callable

import numpy as np
import xarray as xr

from pipeline.posing.case_result import CaseResult, PosedStructure, Times
from pipeline.posing.law_comparison import LAWS, by_contact
from pipeline.posing.structure_variables import (
    Variables,
    network_variables,
    spread,
    unit_coordinates,
)
from pipeline.posing.to_scene import contact_laws, lattice_of
from pipeline.problem import Problem
from pipeline.problem.sections import TimeSeriesDrive, single_drives
from sim.core import Floats

_MOTION = ("structure", "case", "time", "unit", "dof")
_STEP, _CASE = _MOTION[:3], _MOTION[:2]
_OBSERVED = {
    "strain_energy": "strain_energy",
    "contact_energy": "contact_energy",
    "min_void_angle": "void_angle",
    "contact_pairs": "contact_pairs",
    "max_stretch": "stretch",
    "max_shear": "shear",
    "max_bend": "bend",
}
_OF_STEPS = ("roi_energy", "gap", "overlapping", "stability", "snap", "eigenvalue")
_OF_CASES = ("loss", "loss_other_branch", "loss_samples", "loss_error", "displacement_error")

_BACK = 0.5
"""Share of its largest displacement that a swinging motion goes to the other side."""

Table = dict[str, list[CaseResult]]


def assemble_response(
    asked: Problem, structures: dict[str, PosedStructure], times: Times, measured: Table
) -> xr.Dataset:
    """Assembles the dataset ``response`` at the times shown."""
    shown, scene = times.asked[times.shown], structures["altered"].scene
    drive = _drive(structures, shown)
    variables = {
        **network_variables(asked, scene),
        **_over_units(asked, structures, measured),
        **_over_steps(measured),
        **_over_cases(measured),
        **_snaps(measured),
        **by_contact(structures, contact_laws(asked), times, measured),
        "drive_displacement": (("case", "time", "xy"), drive),
    }
    for name in ("loss", "loss_other_branch", "loss_samples", "loss_by_contact"):
        variables[name] = (*variables[name], {"units": loss_units(asked)})
    return xr.Dataset(variables, _coordinates(asked, structures, shown, drive))


def loss_units(asked: Problem) -> str:
    """Returns the unit of a problem's loss."""
    return "N mm" if asked.objective.kind == "strain_energy" else "1"


def case_directions(asked: Problem, moved: Floats | None = None) -> list[float]:
    """Lists the direction of each load case in rad; zero for a drive that has none.

    A motion read from a file has that of the displacement `moved` (n_cases, n_times, 2) by it.
    """
    if moved is not None and isinstance(single_drives(asked.drive)[0], TimeSeriesDrive):
        return [main_direction(course) or 0.0 for course in moved]
    return list(getattr(asked.drive, "directions", (0.0,)))


def main_direction(course: Floats) -> float | None:
    """Finds the direction in rad of the largest of displacements (n_times, 2), if there is any.

    Of a motion that swings it is the one to the right.
    """
    x, y = course[np.hypot(*course.T).argmax()]
    if np.hypot(x, y) == 0.0:
        return None
    angle = float(np.arctan2(y, x))
    leftward = not -np.pi / 2 < angle <= np.pi / 2
    return angle - float(np.copysign(np.pi, angle)) if leftward and swings_back(course) else angle


def swings_back(course: Floats) -> bool:
    """Tests if displacements (n_times, 2) go to both sides of where they start."""
    along = course @ course[np.hypot(*course.T).argmax()]
    return bool(along.min() < -_BACK * along.max())


def _gather(measured: Table, of_case: Callable[[CaseResult], object]) -> Floats:
    return np.array([[of_case(case) for case in cases] for cases in measured.values()])


def _over_units(
    asked: Problem, structures: dict[str, PosedStructure], measured: Table
) -> Variables:
    size = lattice_of(asked).n_units

    def whole(of_case: Callable[[CaseResult], Floats]) -> Floats:
        return np.stack(
            [
                [spread(of_case(case), structures[name].scene.lattice, size, 1) for case in cases]
                for name, cases in measured.items()
            ]
        )

    lattices = [(each.scene.lattice, each.vertices) for each in structures.values()]
    padded = [spread(lattice.padded(places), lattice, size) for lattice, places in lattices]
    return {
        "vertices": (("structure", "unit", "vertex", "xy"), np.stack(padded)),
        "displacement": (_MOTION, whole(lambda case: case.displacement)),
        "velocity": (_MOTION, whole(lambda case: case.velocity)),
        "reaction_force": (_MOTION, whole(lambda case: case.observables.reaction)),
    }


def _over_steps(measured: Table) -> Variables:
    def observed(name: str) -> Floats:
        return _gather(measured, lambda case: getattr(case.observables, name))

    def kept(name: str) -> Floats:
        return _gather(measured, lambda case: getattr(case, name))

    return {
        **{name: (_STEP, observed(source)) for name, source in _OBSERVED.items()},
        **{name: (_STEP, kept(name)) for name in _OF_STEPS},
        "drive_force": ((*_STEP, "xy"), kept("drive_force")),
    }


def _over_cases(measured: Table) -> Variables:
    def kept(name: str) -> Floats:
        return _gather(measured, lambda case: getattr(case, name))

    return {
        **{name: (_CASE, kept(name)) for name in _OF_CASES},
        "min_gap": (_CASE, _gather(measured, lambda case: np.nanmin(case.gap))),
        "overlaps": (_CASE, _gather(measured, lambda case: int(np.nanmax(case.overlapping)))),
    }


def _snaps(measured: Table) -> Variables:
    """Lists snaps, and paths through the first of them, each filled up with NaN."""

    def filled(of_case: Callable[[CaseResult], Floats]) -> Floats:
        parts = [[of_case(case) for case in cases] for cases in measured.values()]
        most = max(1, *(len(part) for cases in parts for part in cases))
        return np.array(
            [
                [
                    np.pad(part, [(0, most - len(part)), *((0, 0),) * (part.ndim - 1)],
                           constant_values=np.nan)
                    for part in cases
                ]
                for cases in parts
            ]
        )  # fmt: skip

    points = (*_CASE, "traced_point")
    return {
        "snap_load": ((*_CASE, "snap_number"), filled(lambda case: case.snaps)),
        "traced_load": (points, filled(lambda case: case.traced.load)),
        "traced_force": ((*points, "xy"), filled(lambda case: case.traced.force)),
        "traced_eigenvalue": (points, filled(lambda case: case.traced.eigenvalue)),
    }


def _drive(structures: dict[str, PosedStructure], times: Floats) -> Floats:
    """Computes the mean displacement (n_cases, n_times, 2) of the first drive's units, mm.

    Degrees of freedom that are not displaced count as at rest.
    """
    scene = structures["altered"].scene
    of_units = np.zeros((len(scene.loads.cases), len(times), 3 * scene.lattice.n_units))
    held, top = scene.loads.held, scene.topology
    for case, drive in enumerate(scene.loads.cases):
        of_units[case][:, held] = drive.values(top.held, times)[:, : len(held)]
    first = np.isin(scene.loads.driven, scene.loads.cases[0].leading)
    units = scene.loads.driven[first]
    moved = of_units.reshape(*of_units.shape[:2], -1, 3)[:, :, units, :2]
    return np.asarray(moved.mean(axis=2))


def _coordinates(
    asked: Problem, structures: dict[str, PosedStructure], times: Floats, moved: Floats
) -> Variables:
    directions, drive = case_directions(asked, moved), single_drives(asked.drive)[0]
    frequency = np.nan if asked.frequency is None else asked.frequency
    return {
        **unit_coordinates(lattice_of(asked)),
        "structure": (("structure",), list(structures)),
        "direction": (("case",), np.rad2deg(directions)),
        "frequency": (("case",), [frequency] * len(directions)),
        "amplitude": (
            ("case",),
            [getattr(drive, "amplitude", np.nan)] * len(directions),
            {"units": drive.unit},
        ),
        "time": (("time",), times),
        "dof": (("dof",), ["ux", "uy", "theta"]),
        "contact_law": (("contact_law",), list(LAWS)),
    }
