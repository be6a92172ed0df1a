"""Checks sections against one another: geometry, regions, supports, loads, the start."""

import math
from collections.abc import Callable

from pipeline.problem import Problem, cloak_units
from pipeline.problem.reading import load_checks, region_checks
from pipeline.problem.reading.fault import Findings, ProblemFault
from pipeline.problem.sections import (
    HarmonicDrive,
    Lattice,
    ListedNetwork,
    Quads,
    RampHarmonicDrive,
    Regular,
)


def find_faults(problem: Problem) -> Findings:
    """Finds the faults of a problem, in the order in which they should be mended."""
    for check in _CHECKS:
        yield from check(problem)


def _lattice(problem: Problem) -> Findings:
    lattice = problem.lattice
    if isinstance(lattice, ListedNetwork):
        return
    if lattice.ligament_length >= lattice.spacing:
        what = f"ligaments of {lattice.ligament_length:g} mm leave no room for units"
        remedy = f"keep it below the spacing, {lattice.spacing:g} mm"
        yield ProblemFault(what, ("lattice", "ligament_length"), remedy)
    if isinstance(lattice, Regular) and lattice.void_angle <= 0:
        most = f"{(180.0 - lattice.block_angle) / 2:g} deg"
        what = f"a bias of {math.degrees(lattice.bias):g} deg closes the voids"
        yield ProblemFault(what, ("lattice", "bias_angle"), f"keep it between -{most} and {most}")


def _contact(problem: Problem) -> Findings:
    contact = problem.contact
    barrier, cutoff = (
        math.degrees(angle) for angle in (contact.barrier_angle, contact.cutoff_angle)
    )
    if barrier >= cutoff:
        what = f"the barrier ({barrier:g} deg) is not below the cut-off ({cutoff:g} deg)"
        yield ProblemFault(what, ("contact", "barrier_angle"), f"keep it below {cutoff:g} deg")
    elif cutoff >= (void := _least_void(problem.lattice)):
        what = f"the undeformed lattice is in contact: its void angles start at {void:g} deg"
        yield ProblemFault(what, ("contact", "cutoff_angle"), f"keep it below {void:g} deg")


def _least_void(lattice: Lattice) -> float:
    """Finds the smallest void angle of a lattice at rest, deg."""
    if isinstance(lattice, Regular):
        return lattice.void_angle
    return lattice.least_void


def _contact_distance(problem: Problem) -> Findings:
    distance, gap = problem.contact.distance, problem.constraints.gap
    room = problem.lattice.ligament_length if gap is None else gap
    if distance is not None and distance > room:
        near = "ligaments hold units" if gap is None else "the constraint `gap` lets units be"
        what = f"{near} {room:g} mm apart, within the contact distance, {distance:g} mm"
        yield ProblemFault(
            what, ("contact", "distance"), f"keep it to {room:g} mm, or leave it out"
        )


def _foil(problem: Problem) -> Findings:
    strip, made = problem.material.foil, problem.fabrication
    if strip is None:
        return
    for name, cut, model in (
        ("shims.thickness", made.shims.thickness, strip.thickness),
        ("shims.young_modulus", made.shims.young_modulus, strip.young_modulus),
        ("thickness", made.thickness, strip.width),
    ):
        if not math.isclose(cut, model):
            what = f"it is {cut:g} here, and {model:g} by material.foil"
            keys = ("fabrication", *name.split("."))
            yield ProblemFault(what, keys, "leave it out: material.foil says it")


def _robust(problem: Problem) -> Findings:
    robust = problem.objective.robust
    if problem.objective.snap == "avoid" and not problem.static:
        what = f"a structure under a {problem.drive.kind} drive has no path of equilibria"
        yield ProblemFault(what, ("objective", "snap"), "leave it out, or drive by a linear_ramp")
    varied = isinstance(problem.drive, HarmonicDrive | RampHarmonicDrive)
    if robust is not None and robust.loads and not varied:
        what = f"a {problem.drive.kind} drive has no frequency and displacement to vary"
        remedy = "leave them out, or drive by harmonic or ramp_harmonic"
        yield ProblemFault(what, ("objective", "robust", "loads"), remedy)


def _straight_shims(problem: Problem) -> Findings:
    way = problem.fabrication.slots.direction
    if problem.constraints.straight_shims and way != "ligament":
        line = {"centroid": "to the centroid", "bisector": "along the bisector"}[way]
        what = f"constraints.straight_shims makes room along ligaments, and slots are drawn {line}"
        place = ("fabrication", "slots", "direction")
        yield ProblemFault(what, place, "leave it at ligament, or leave straight_shims out")


def _start_is_feasible(problem: Problem) -> Findings:
    lattice, limits = problem.lattice, problem.constraints
    if not isinstance(lattice, Regular):
        return
    start = {
        "edge_length": (limits.edge_length, lattice.edge_length, "mm"),
        "block_angle": (_degrees(limits.block_angle), lattice.block_angle, "deg"),
        "void_angle": (_degrees(limits.void_angle), lattice.void_angle, "deg"),
        "gap": (limits.gap, lattice.ligament_length, "mm"),
    }
    for name, (asked, has, unit) in start.items():
        if asked is not None and asked > has:
            first = lattice.name(cloak_units(problem)[0])
            what = f"infeasible at the start: the undeformed units have {has:g} {unit}"
            what += f" (vertex 0 of unit {first} and all alike)"
            yield ProblemFault(what, ("constraints", name), f"ask for at most {has:.3g} {unit}")


def _degrees(angle: float | None) -> float | None:
    return None if angle is None else math.degrees(angle)


def _symmetry(problem: Problem) -> Findings:
    lattice = problem.lattice
    if not isinstance(lattice, Quads):
        return
    if problem.optimiser.symmetry == "C4" and lattice.columns != lattice.rows:
        what = f"a lattice of {lattice.columns} x {lattice.rows} has no fourfold symmetry"
        yield ProblemFault(what, ("optimiser", "symmetry"), "use none, mirror_x or mirror_y")


def _optimiser(problem: Problem) -> Findings:
    optimiser = problem.optimiser
    if not optimiser.methods.chosen:
        yield ProblemFault("no method chosen", ("optimiser", "methods"), "give sqp, mma or both")
    if optimiser.trust_radius > optimiser.trust_radius_max:
        remedy = f"keep it at or below {optimiser.trust_radius_max:g} mm"
        yield ProblemFault("larger than its maximum", ("optimiser", "trust_radius"), remedy)


_CHECKS: tuple[Callable[[Problem], Findings], ...] = (
    _lattice,
    _contact,
    _contact_distance,
    _foil,
    load_checks.units_exist,
    load_checks.drive_is_free,
    load_checks.one_kind_of_load,
    load_checks.spectrum,
    load_checks.horizon,
    load_checks.ramps_end,
    load_checks.drive_comes,
    load_checks.samples,
    _robust,
    load_checks.reaction,
    load_checks.loads_in_ranges,
    region_checks.void,
    region_checks.inclusion,
    region_checks.target,
    region_checks.regions,
    _straight_shims,
    _start_is_feasible,
    _symmetry,
    _optimiser,
)
