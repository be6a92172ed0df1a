"""Poses the scene that sim/ simulates from a problem."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline import problem as problems
from pipeline.posing.failures import without_meaning
from pipeline.problem import Problem
from pipeline.problem.fields import csv_columns, units
from pipeline.problem.sections import (
    STIFFNESSES,
    ForceDrive,
    HarmonicDrive,
    LinearRampDrive,
    ListedNetwork,
    PulseDrive,
    RampHarmonicDrive,
    RotationDrive,
    Selector,
    SingleDrive,
    TanhRampDrive,
    TimeSeriesDrive,
    TorqueDrive,
    selected_units,
    single_drives,
)
from pipeline.runtime import UserError
from sim.constraints import Limits
from sim.core import Floats, Numbers
from sim.energy import activation_distance
from sim.scene import (
    DOFS,
    Clamp,
    Design,
    Loads,
    Numerics,
    Objective,
    Scene,
    SceneError,
    Structure,
    check_scene,
)
from sim.solvers import DISPLACEMENT, FORCE, FREE, PrescribedMotion, loads
from sim.structure import (
    ContactModel,
    DistanceContact,
    FoilLimit,
    Lattice,
    Material,
    VoidAngleContact,
)

DirectedDrive = (
    HarmonicDrive | RampHarmonicDrive | PulseDrive | TanhRampDrive | LinearRampDrive | ForceDrive
)
BENT = float(np.radians(30.0))
"""Angle between the ends of a shim and its ligament beyond which the law of ligaments, that of a
beam of small slopes, is an indication only: its tangent is 10 % longer."""
TIME_SERIES = {"time": units.TIME, "ux": units.LENGTH, "uy": units.LENGTH, "theta": units.ANGLE}
"""Columns of a measured drive, whose heading names each with its unit in brackets."""


def lattice_of(problem: Problem) -> Lattice:
    """Builds the intact initial network of a problem."""
    return problem.lattice.network()


def altered_lattice_of(problem: Problem) -> Lattice:
    """Builds the initial network of a problem with its void."""
    return lattice_of(problem).without(_units(problems.void_units(problem)))


def scene_of(
    problem: Problem, folder: Path, motions: tuple[loads.MotionLaw, ...] | None = None
) -> Scene:
    """Poses the scene of a problem whose files lie in ``folder``, or with other ``motions``.

    Raises:
        UserError: the file of a measured drive cannot be read, the scene has no meaning, or not the
            symmetry that its designs are to have.
    """
    made = motions_of(problem, folder) if motions is None else motions
    intact, altered = lattice_of(problem), altered_lattice_of(problem)
    material, law = material_of(problem, intact), contact_laws(problem)[problem.contact.law]
    weights = None if motions is not None else np.asarray(problem.drive.case_weights)
    interest, samples = _units(problems.interest_units(problem)), problem.horizon.samples
    scene = Scene(
        Structure(intact, material, law),
        _loads(problem, intact, made, weights),
        Objective(
            region=interest,
            kind=problem.objective.kind,
            samples=samples + 1 - samples % 2,
            steps=problem.horizon.steps,
            snap_margin=problem.objective.snap_margin
            if problem.objective.snap == "avoid"
            else None,
            foil=foil_limit(problem),
        ),
        numerics=Numerics(problem.solver.accuracy, problem.solver.integrator),
    )
    posed = replace(
        scene,
        structure=Structure(altered, _stiffened(problem, altered), law),
        loads=_loads(problem, altered, made, weights),
        objective=replace(
            scene.objective,
            region=altered.positions(interest),
            reference=scene if problem.objective.target == "intact" else None,
        ),
        design=Design(
            cloak=altered.positions(_units(problems.cloak_units(problem))),
            frozen=altered.positions(_units(problems.source_units(problem))),
            symmetry=problem.optimiser.symmetry,
            turning_slots=problem.optimiser.as_built,
        ),
    )
    try:
        check_scene(posed)
    except SceneError as error:
        raise without_meaning(error) from error
    _check_symmetry(posed)
    return posed


def _check_symmetry(scene: Scene) -> None:
    if (asked := scene.design.symmetry) == "none":
        return
    try:
        _ = scene.space
    except ValueError as error:
        remedy = "ask for none, or for one that lattice and cloak have"
        raise UserError(str(error), key="optimiser.symmetry", value=asked, remedy=remedy) from error


def _loads(
    problem: Problem,
    lattice: Lattice,
    motions: tuple[loads.MotionLaw, ...],
    weights: NDArray[np.float64] | None,
) -> Loads:
    driven, control = driven_units(problem, lattice), control_of(problem)
    return Loads(
        cases=tuple(PrescribedMotion(driven, motion, control) for motion in motions),
        supports=tuple(
            Clamp(_selected(problem, support.units, lattice), support.clamp)
            for support in problem.supports
        ),
        duration=problem.horizon_time,
        frequency=problem.frequency,
        static=problem.static,
        weights=weights,
    )


def _selected(problem: Problem, units: Selector, lattice: Lattice) -> NDArray[np.int64]:
    return lattice.positions(_units(problems.selected_units(units, problem.lattice)))


def _units(ids: Iterable[int]) -> NDArray[np.int64]:
    return np.array(sorted(ids), dtype=np.int64)


def contact_laws(problem: Problem) -> dict[str, ContactModel]:
    """Builds the laws of contact by their names in the problem file, whichever it asks for."""
    asked, ligament = problem.contact, problem.lattice.ligament_length
    by_default = activation_distance(ligament, problem.constraints.gap)
    return {
        "angle": VoidAngleContact(asked.barrier_angle, asked.cutoff_angle),
        "geometric": DistanceContact(by_default if asked.distance is None else asked.distance),
    }


def limits_of(problem: Problem) -> Limits:
    """Reads the limits that a design must keep to so that it can be made."""
    asked, turning = problem.constraints, problem.optimiser.as_built
    return Limits(
        edge_length=asked.edge_length,
        block_angle=asked.block_angle,
        convex=asked.convex,
        void_angle=asked.void_angle,
        gap=asked.gap,
        slots=problem.fabrication.slot_room if asked.straight_shims or turning else None,
        slot_turn=BENT if turning else None,
    )


def driven_units(problem: Problem, lattice: Lattice) -> NDArray[np.int64]:
    """Finds the places of the units of a network that any drive moves."""
    return lattice.positions(np.array(problems.driven_units(problem), dtype=np.int64))


def control_of(problem: Problem) -> NDArray[np.int64] | None:
    """Tells what (n_driven, 3) the drives prescribe of each driven unit: see `PrescribedMotion`.

    None where they displace all degrees of freedom.
    """
    driven = problems.driven_units(problem)
    control = np.full((len(driven), 3), FREE)
    for drive in single_drives(problem.drive):
        rows = np.isin(driven, selected_units(drive.units, problem.lattice))
        for dof, name in enumerate(DOFS):
            if isinstance(drive, ForceDrive | TorqueDrive) and name in drive.acting:
                control[rows, dof] = FORCE
            elif name not in drive.free:
                control[rows, dof] = DISPLACEMENT
    return None if (control == DISPLACEMENT).all() else control


def foil_limit(problem: Problem) -> FoilLimit | None:
    """Reads how far the foil of the ligaments may be strained."""
    most = problem.constraints.shim_strain
    return None if most is None else FoilLimit(problem.shim_thickness, most)


def material_of(problem: Problem, lattice: Lattice) -> Material:
    """Reads the constants of a specimen of some lattice, without those of an inclusion."""
    translation, rotation = problem.damping_coefficients
    axial, shear, bending = _stiffnesses(problem, lattice)
    return Material(
        density=problem.material.density,
        axial_stiffness=axial,
        shear_stiffness=shear,
        bending_stiffness=bending,
        contact_stiffness=problem.contact.stiffness,
        damping_translation=translation,
        damping_rotation=rotation,
    )


def _stiffnesses(problem: Problem, lattice: Lattice) -> Sequence[float | Numbers]:
    """Reads axial, shear and bending stiffness, arrays where a file lists the ligaments."""
    alike = _shim_stiffnesses(problem, lattice)
    if not isinstance(problem.lattice, ListedNetwork):
        return alike
    if (listed := problem.lattice.stiffnesses) is None:
        return alike
    intact = lattice_of(problem)
    kept = np.isin(intact.id[intact.ligament_units], lattice.id).all(axis=1)
    own = np.array(listed, dtype=float)[kept].T  # NaN where the file gives none
    return [np.where(np.isnan(each), other, each) for each, other in zip(own, alike, strict=True)]


def _shim_stiffnesses(problem: Problem, lattice: Lattice) -> Sequence[float | Numbers]:
    """Reads the three stiffnesses of ligaments that neither a file nor an inclusion alters."""
    given = problem.material
    if isinstance(problem.lattice, ListedNetwork) and given.foil is not None:
        return given.foil.foil.stiffness(np.linalg.norm(lattice.ligament_vectors, axis=1))
    return [getattr(given, name) for name in STIFFNESSES]


def stiffness_factors(problem: Problem, structure: str) -> Floats:
    """Divides the stiffness of ligaments by that of shims: axial, shear, bending (n_ligaments, 3).

    All ligaments of the intact structure are listed, in the order of a design's; in the structures
    "altered" and "cloaked" an inclusion is stiff.
    """
    lattice = lattice_of(problem)
    of_structure = material_of if structure == "intact" else _stiffened
    material = of_structure(problem, lattice)
    factors = [
        getattr(material, name) / np.broadcast_to(shim, lattice.ligament_units.shape[:1])
        for name, shim in zip(STIFFNESSES, _shim_stiffnesses(problem, lattice), strict=True)
    ]
    return np.stack(factors, axis=1)


def _stiffened(problem: Problem, lattice: Lattice) -> Material:
    """Stiffens the ligaments of an inclusion's units as much as asked for."""
    material = material_of(problem, lattice)
    if problem.inclusion is None:
        return material
    stiff = lattice.positions(_units(problems.inclusion_units(problem)))
    touched = np.isin(lattice.ligament_units, stiff).any(axis=1)
    factor = np.where(touched, problem.inclusion.stiffness_factor, 1.0)
    return material._replace(
        axial_stiffness=material.axial_stiffness * factor,
        shear_stiffness=material.shear_stiffness * factor,
        bending_stiffness=material.bending_stiffness * factor,
    )


def motions_of(problem: Problem, folder: Path) -> tuple[loads.MotionLaw, ...]:
    """Builds the motion of every load case, or the forces, of the driven units in their order."""
    drives = single_drives(problem.drive)
    if len(drives) == 1 and not isinstance(drives[0], ForceDrive | TorqueDrive):
        return _motions(drives[0], problem.horizon_time, folder)
    driven, count = problems.driven_units(problem), len(problem.drive.case_weights)
    shares, motions = np.zeros((len(driven), len(drives))), []
    for k, drive in enumerate(drives):
        rows = np.isin(driven, selected_units(drive.units, problem.lattice))
        loads_them = isinstance(drive, ForceDrive | TorqueDrive)
        shares[rows, k] = 1.0 / np.count_nonzero(rows) if loads_them else 1.0
        found = _motions(drive, problem.horizon_time, folder)
        motions.append(found * count if len(found) == 1 else found)
    return tuple(loads.Superposition(each, shares) for each in zip(*motions, strict=True))


def _motions(drive: SingleDrive, horizon: float, folder: Path) -> tuple[loads.MotionLaw, ...]:
    if isinstance(drive, TimeSeriesDrive):
        return (_measured(folder / drive.file),)
    if isinstance(drive, TorqueDrive | RotationDrive):
        return (loads.Turning(_motion_law(drive, 0.0, horizon)),)
    return tuple(_motion_law(drive, angle, horizon) for angle in drive.directions)


def _motion_law(
    drive: DirectedDrive | TorqueDrive | RotationDrive, direction: float, horizon: float
) -> loads.MotionLaw:
    """Builds the course of a drive along a direction, rad; of a moment, as if it were a force."""
    size = drive.amplitude
    match drive:
        case RampHarmonicDrive():
            return loads.Harmonic(size, drive.frequency, direction, drive.rise_time, drive.delay)
        case HarmonicDrive():
            return loads.Harmonic(size, drive.frequency, direction)
        case PulseDrive():
            return loads.Pulse(size, drive.width, direction, drive.delay)
        case TanhRampDrive():
            return loads.TanhRamp(size, drive.duration, direction)
        case LinearRampDrive():
            return loads.LinearRamp(size, drive.duration, direction)
    return _load_law(drive, direction, horizon)


def _load_law(
    drive: ForceDrive | TorqueDrive | RotationDrive, direction: float, horizon: float
) -> loads.MotionLaw:
    """Builds the course of a load that may be a pulse, a wave or a path."""
    if drive.width is not None:
        return loads.Pulse(drive.amplitude, drive.width, direction, drive.delay)
    if drive.frequency is not None:
        rise, delay = drive.rise_time, drive.delay
        return loads.Harmonic(drive.amplitude, drive.frequency, direction, rise, delay)
    return loads.LinearRamp(drive.amplitude, horizon, direction)


def _measured(path: Path) -> loads.TimeSeries:
    """Reads a measured motion: a CSV with the columns TIME_SERIES, times ascending."""
    table = csv_columns.read_quantities(path, TIME_SERIES)
    if (np.diff(table[:, 0]) <= 0).any():
        remedy = "sort it by time, each time once"
        raise UserError("the measured drive needs ascending times", file=path, remedy=remedy)
    if not table[:, 1:].any():
        remedy = "give a motion: the loss is a share of the one it causes"
        raise UserError("the measured drive moves nothing", file=path, remedy=remedy)
    return loads.TimeSeries(table[:, 0], table[:, 1:])
