"""Stage: simulates the imperfect specimen of a virtual recording."""

import argparse

import numpy as np
import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.posing import (
    PosedStructure,
    case_directions,
    lattice_of,
    network_variables,
    read_design,
    scene_of,
    spread,
    structures_of,
    times_of,
    unit_coordinates,
)
from pipeline.problem import Problem
from pipeline.problem.sections import ForceDrive, RotationDrive, TorqueDrive, single_drives
from pipeline.runtime import UserError, found_in
from pipeline.tracking.frames import Recording
from pipeline.tracking.frames import recording as recordings
from pipeline.virtual_lab import make_specimen
from sim.core import Floats, SimulationError
from sim.scene import Scene, simulate


def work(args: argparse.Namespace) -> None:
    """Reads problem, design and recording, simulates the specimen, writes what it does.

    Raises:
        UserError: the recording has no specimen, or it cannot be made or simulated.
    """
    recording = recordings.load_recording(args.recording)
    asked = problem.load(args.problem, args.preset)
    held = structures_of(scene_of(asked, args.problem.parent), read_design(asked, args.design))
    with found_in(args.recording):
        made = specimen_dataset(asked, held, recording)
    origin = provenance.of_study(asked, "virtual_specimen", parents={"design": args.design})
    told = {"recording": recording.model_dump_json(), "synthetic": "yes"}
    datasets.write(made, args.out, "specimen", origin | told)


def specimen_dataset(
    asked: Problem, held: dict[str, PosedStructure], recording: Recording
) -> xr.Dataset:
    """Makes the dataset ``specimen``: the response of a recording's specimen to its load case.

    Raises:
        UserError: the recording has no specimen, or it cannot be made or simulated.
    """
    virtual = recording.virtual
    if virtual is None or virtual.specimen is None:
        remedy = "describe the specimen there"
        raise UserError("the recording has no specimen", key="virtual.specimen", remedy=remedy)
    _check_drive(asked)
    structure = _select_structure(held, recording)
    times = _times(asked, structure.scene, virtual.specimen.unload)
    made = make_specimen(structure, recording.case, virtual.specimen, times[-1])
    return _assemble(asked, held["altered"].scene, made, recording.case, times)


def _check_drive(asked: Problem) -> None:
    """Refuses drives that a specimen's faults are not of: but one displacement of all units."""
    drives = single_drives(asked.drive)
    if len(drives) > 1 or isinstance(drives[0], ForceDrive | TorqueDrive | RotationDrive):
        what = (
            f"a specimen is driven by one displacement, the study by drive.kind: {asked.drive.kind}"
        )
        remedy = "leave it out, so that the study's own response is filmed"
        raise UserError(what, key="virtual.specimen", remedy=remedy)


def _select_structure(held: dict[str, PosedStructure], recording: Recording) -> PosedStructure:
    structure = held.get(recording.structure)
    if structure is None:
        remedy = f"give one of: {', '.join(held)}"
        what = "the study has no such structure"
        raise UserError(what, key="structure", value=recording.structure, remedy=remedy)
    cases = len(structure.scene.loads.motions)
    if recording.case >= cases:
        remedy = f"give a number from 0 to {cases - 1}"
        raise UserError(
            "the study has no such case", key="case", value=recording.case, remedy=remedy
        )
    return structure


def _times(asked: Problem, scene: Scene, unload: bool) -> Floats:
    """Lists the times of the response, and as many again on the way back."""
    wanted = times_of(asked, scene)
    times = wanted.asked[wanted.shown]
    if not unload:
        return times
    if not scene.loads.static:
        remedy = "leave it out: a motion in time comes back by itself"
        raise UserError("no static load", key="virtual.specimen.unload", remedy=remedy)
    return np.concatenate([times, 2 * times[-1] - times[-2::-1]])


def _assemble(
    asked: Problem, altered: Scene, made: PosedStructure, case: int, times: Floats
) -> xr.Dataset:
    scene, vertices = made
    intact, lattice = lattice_of(asked), scene.lattice
    motion, force = _simulate(made, times)
    drive = motion[:, scene.loads.driven, :2].mean(axis=1)
    variables = {
        **network_variables(asked, altered),
        "vertices": (
            ("unit", "vertex", "xy"),
            spread(lattice.padded(vertices), lattice, intact.n_units),
        ),
        "displacement": (("time", "unit", "dof"), spread(motion, lattice, intact.n_units, 1)),
        "drive_displacement": (("time", "xy"), drive),
        "drive_force": (("time", "xy"), force),
    }
    coordinates = {
        **unit_coordinates(intact),
        "direction": ((), np.rad2deg(case_directions(asked, drive[None])[case])),
        "time": (("time",), times),
        "dof": (("dof",), ["ux", "uy", "theta"]),
    }
    return xr.Dataset(variables, coordinates)


def _simulate(made: PosedStructure, times: Floats) -> tuple[Floats, Floats]:
    """Simulates displacement (n_times, n_units, 3) and force of the drive (n_times, 2), N."""
    scene, vertices = made
    try:
        response = simulate(scene, vertices=vertices, times=times)
    except SimulationError as error:
        remedy = "give another seed, or smaller tolerances"
        raise UserError(
            f"the specimen cannot be simulated: {error}", key="virtual.specimen", remedy=remedy
        ) from error
    return response.displacement[0], response.drive_force[0]
