"""Checks sections against one another: geometry, regions, supports, loads, the start."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from pipeline.problem import Problem, cloak_units, inclusion_units, interest_units, void_units
from pipeline.problem.reading.yaml_file import KeyPath
from pipeline.problem.sections import (
    DisplacementDrive,
    LinearRampDrive,
    ListedNetwork,
    LoadRanges,
    Quads,
    Region,
    Regular,
    Selector,
    SeveralDrives,
    SingleDrive,
    TanhRampDrive,
    TestSetup,
    loose_units,
    resolve_centre,
    selected_units,
    single_drives,
)


@dataclass(frozen=True)
class ProblemFault:
    """Reports a fault in a problem, its key, and its remedy."""

    what: str
    keys: KeyPath
    remedy: str


Findings = Iterator[ProblemFault]


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
    elif isinstance(problem.lattice, Regular) and cutoff >= (void := problem.lattice.void_angle):
        what = f"the undeformed lattice is in contact: its void angles start at {void:g} deg"
        yield ProblemFault(what, ("contact", "cutoff_angle"), f"keep it below {void:g} deg")


def _contact_distance(problem: Problem) -> Findings:
    distance, gap = problem.contact.distance, problem.constraints.gap
    room = problem.lattice.ligament_length if gap is None else gap
    if distance is not None and distance > room:
        what = f"units {room:g} mm apart at rest are within the contact distance, {distance:g} mm"
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


def _selectors(problem: Problem) -> Iterator[tuple[KeyPath, Selector]]:
    for index, support in enumerate(problem.supports):
        yield ("supports", index, "units"), support.units
    for keys, drive in _drives(problem):
        yield (*keys, "units"), drive.units


def _drives(problem: Problem) -> Iterator[tuple[KeyPath, SingleDrive]]:
    if not isinstance(problem.drive, SeveralDrives):
        yield ("drive",), problem.drive
        return
    for index, drive in enumerate(problem.drive.drives):
        yield ("drives", index), drive


def _units_exist(problem: Problem) -> Findings:
    for keys, selector in _selectors(problem):
        try:
            selected_units(selector, problem.lattice)
        except IndexError as error:
            yield ProblemFault(str(error), keys, problem.lattice.extent)


def _drive_is_free(problem: Problem) -> Findings:
    others: list[tuple[set[int], SingleDrive]] = []
    for keys, drive in _drives(problem):
        driven = set(selected_units(drive.units, problem.lattice))
        for support in problem.supports:
            both = sorted(driven & set(selected_units(support.units, problem.lattice)))
            if both and not set(drive.acting).isdisjoint(support.clamp):
                what = f"unit {problem.lattice.name(both[0])} is driven and clamped"
                yield ProblemFault(what, (*keys, "units"), "drive or clamp it, not both")
        for units, other in others:
            if (both := sorted(driven & units)) and (dof := _contested(drive, other)):
                what = f"unit {problem.lattice.name(both[0])} is driven twice, along {dof}"
                remedy = "give every unit to one drive, or let the others' way be `free`"
                yield ProblemFault(what, (*keys, "units"), remedy)
        others.append((driven, drive))


def _contested(one: SingleDrive, other: SingleDrive) -> str | None:
    """Names a degree of freedom that one of two drives moves and the other does not leave free."""
    held = [{"ux", "uy", "theta"} - set(drive.free) for drive in (one, other)]
    moved = [set(drive.acting) for drive in (one, other)]
    return min(held[0] & moved[1] | held[1] & moved[0], default=None)


def _one_kind_of_load(problem: Problem) -> Findings:
    kinds = single_drives(problem.drive)
    if len(kinds) > 1 and not problem.static:
        slow = [d.kind for d in kinds if problem.model_copy(update={"drive": d}).static]
        if slow:
            what = f"a {slow[0]} is a slow load, and another of the drives is not"
            yield ProblemFault(what, ("drives",), "give all of them a course in time, or none")
    if problem.spectrum is not None and any(d.kind in ("force", "torque") for d in kinds):
        what = "a spectrum tells the transmission of a displacement, not of a force"
        yield ProblemFault(what, ("spectrum",), "leave it out, or drive by a displacement")


def _steps_of(problem: Problem) -> bool:
    """Tells a path whose loads can be equal steps."""
    return all(
        isinstance(drive, LinearRampDrive) or getattr(drive, "static", False)
        for drive in single_drives(problem.drive)
    )


def _horizon(problem: Problem) -> Findings:
    if problem.horizon.periods is not None and problem.frequency is None:
        what = f"a {problem.drive.kind} drive has no period"
        yield ProblemFault(what, ("horizon", "periods"), 'give `duration`, e.g. "1 s"')
    if problem.horizon.steps is not None and not _steps_of(problem):
        what = f"a {problem.drive.kind} drive does not load in equal steps"
        yield ProblemFault(what, ("horizon", "steps"), "drive by a linear_ramp, or give `samples`")


def _robust(problem: Problem) -> Findings:
    robust = problem.objective.robust
    if problem.objective.snap == "avoid" and not problem.static:
        what = f"a structure under a {problem.drive.kind} drive has no path of equilibria"
        yield ProblemFault(what, ("objective", "snap"), "leave it out, or drive by a linear_ramp")
    if robust is not None and robust.loads and problem.frequency is None:
        what = f"a {problem.drive.kind} drive has no frequency to vary"
        yield ProblemFault(what, ("objective", "robust", "loads"), "leave them out")


def _reaction(problem: Problem) -> Findings:
    objective, place = problem.objective, ("objective", "reaction")
    if objective.reaction is None:
        return
    if not isinstance(problem.drive, DisplacementDrive):
        what = f"a drive of the kind {problem.drive.kind} has no displacement that a force answers"
        yield ProblemFault(what, place, "leave it out, or displace units along a direction")
    if objective.target == "rest":
        what = "a structure at rest has no force of the drive to mimic"
        yield ProblemFault(what, place, "leave it out, or give target: intact")
    if objective.loads is not None:
        what = "over loads in ranges motions alone are mimicked"
        yield ProblemFault(what, place, "leave out one of the two")


def _loads(problem: Problem) -> Findings:
    """Finds what a family of loads cannot be of, or cannot be minimised over."""
    objective = problem.objective
    if (family := objective.loads) is None:
        return
    place = ("objective", "loads")
    yield from _ranges(problem, family, place)
    yield from _drive_is_free(_turned(problem, family))
    for index, setup in enumerate(family.setups):
        posed, keys = problem.in_setup(setup), (*place, "setups", index)
        turned = _turned(posed, setup)
        for check in (_units_exist, _drive_is_free, _one_kind_of_load, _horizon):
            yield from (replace(found, keys=(*keys, *found.keys)) for found in check(turned))
        yield from _ranges(posed, setup, keys)
        if (posed.static, posed.frequency is None) != (problem.static, problem.frequency is None):
            what = f"a {setup.drive.kind} drive is of another kind than the study's"
            yield ProblemFault(what, (*keys, "drive"), f"give one like a {problem.drive.kind}")
    if objective.robust is not None and objective.robust.loads:
        what = "loads in ranges take the place of some"
        yield ProblemFault(what, ("objective", "robust", "loads"), "leave out one of the two")
    if objective.snap == "avoid":
        what = "loads in ranges have no one path to keep from snapping"
        yield ProblemFault(what, ("objective", "snap"), "leave out one of the two")
    if problem.optimiser.methods.mma is not None:
        what = "the worst of many loads is minimised by sqp alone"
        yield ProblemFault(what, ("optimiser", "methods", "mma"), "leave it out (a preset: null)")


def _turned(problem: Problem, ranges: LoadRanges | TestSetup) -> Problem:
    """Turns the drive of a problem along all directions of a range, as far as that matters."""
    if ranges.directions is None or not isinstance(problem.drive, DisplacementDrive):
        return problem
    low, high = ranges.directions
    ways = (low, 0.75 * low + 0.25 * high, high)  # not all along one axis, unless the range is
    drive = problem.drive.model_copy(update={"directions": ways, "weights": None})
    return problem.model_copy(update={"drive": drive})


def _ranges(problem: Problem, ranges: LoadRanges | TestSetup, place: KeyPath) -> Findings:
    """Finds ranges that the drive of a set-up does not have."""
    drive = problem.drive
    if isinstance(drive, SeveralDrives):
        parts = drive.drives
        ramps = all(isinstance(part, LinearRampDrive | TanhRampDrive) for part in parts)
        if len(parts) != 2 or not ramps or len(drive.case_weights) > 1:
            what = "loads in ranges are mixtures of two slow displacements"
            yield ProblemFault(what, place, "give two ramps, of one direction each")
    elif not isinstance(drive, DisplacementDrive):
        what = f"a drive of the kind {drive.kind} has no displacement and direction to vary"
        yield ProblemFault(what, place, "leave it out, or displace units along a direction")
    elif ranges.frequency is not None and problem.frequency is None:
        what = f"a {drive.kind} drive has no frequency to vary"
        yield ProblemFault(what, (*place, "frequency"), "leave it out")
    elif ranges.frequency is not None and problem.horizon.periods is None:
        what = "a time does not fit loads of all frequencies"
        yield ProblemFault(what, ("horizon", "duration"), "give `periods`")


def _region_fits(problem: Problem, region: Region, keys: KeyPath) -> Findings:
    lattice = problem.lattice
    if region.bounds is None:
        return
    centre, inner, outer = region.bounds
    x, y = resolve_centre(centre, lattice.centre_site)
    margin = 0.5 * lattice.spacing
    _, across, up = zip(*lattice.sites(), strict=True)
    room = margin + min(x - min(across), y - min(up), max(across) - x, max(up) - y)
    shape = "disc" if region.disc is not None else "ring"
    key = "radius" if shape == "disc" else "outer"
    if room < 0:
        what = f"the centre of the {' '.join(map(str, keys))} lies outside the lattice"
        extent = f"{max(across):g} by {max(up):g} mm"
        yield ProblemFault(what, (*keys, shape, "centre"), f"the outermost sites span {extent}")
    elif outer > room:
        what = f"{keys[0]} of radius {outer:g} mm reaches beyond the lattice"
        remedy = f"keep it within {room:g} mm of its centre ({x:g}, {y:g}) mm"
        yield ProblemFault(what, (*keys, shape, key), remedy)
    elif inner >= outer:
        what = f"the ring's inner radius ({inner:g} mm) is not below the outer ({outer:g} mm)"
        yield ProblemFault(what, (*keys, shape, "inner"), f"keep it below {outer:g} mm")


def _regions(problem: Problem) -> Findings:
    if problem.void is not None:
        yield from _region_fits(problem, problem.void, ("void",))
    if problem.inclusion is not None:
        yield from _region_fits(problem, problem.inclusion.region, ("inclusion", "region"))
    if isinstance(problem.objective.region, Region):  # then the cloak may lie around it
        yield from (*_interest(problem), *_cloak(problem))
    else:  # then it is what the cloak leaves
        yield from (*_cloak(problem), *_interest(problem))


def _cloak(problem: Problem) -> Findings:
    yield from _region_fits(problem, problem.cloak, ("cloak",))
    if not cloak_units(problem):
        what = "no unit lies in the cloak (driven units and the region of interest are left out)"
        yield ProblemFault(what, ("cloak",), "enlarge it, or move its centre")


def _interest(problem: Problem) -> Findings:
    if isinstance(problem.objective.region, Region):
        yield from _region_fits(problem, problem.objective.region, ("objective", "region"))
    if interest_units(problem):
        return
    what = "no unit lies in the region of interest"
    if problem.objective.region == "surroundings":
        yield ProblemFault(what, ("cloak",), "leave units outside it")
    else:
        yield ProblemFault(what, ("objective", "region"), "enlarge it, or move its centre")


def _void(problem: Problem) -> Findings:
    if problem.void is None:
        return
    removed = void_units(problem)
    if not removed:
        yield ProblemFault("no unit lies in the void", ("void",), "enlarge it, or move its centre")
    yield from _void_and_supports(problem, set(removed))
    yield from _void_and_rest(problem, set(removed))


def _inclusion(problem: Problem) -> Findings:
    if problem.inclusion is None:
        return
    stiff = set(inclusion_units(problem))
    if not stiff:
        what = "no unit lies in the inclusion"
        yield ProblemFault(what, ("inclusion", "region"), "enlarge it, or move its centre")
    if both := sorted(stiff & set(void_units(problem))):
        what = f"unit {problem.lattice.name(both[0])} is in the void and in the inclusion"
        yield ProblemFault(what, ("inclusion", "region"), "keep the two apart")


def _target(problem: Problem) -> Findings:
    if problem.objective.target == "rest":
        return
    if problem.objective.kind == "strain_energy":
        what = "an energy is compared with that at rest"
        yield ProblemFault(what, ("objective", "target"), "give `rest`, or kind: displacement")
    if problem.void or problem.inclusion:
        return
    what = "nothing is altered, so there is nothing to mimic"
    yield ProblemFault(what, ("objective", "target"), "add `void:` or `inclusion:`, or give rest")


def _void_and_supports(problem: Problem, removed: set[int]) -> Findings:
    lattice = problem.lattice
    for keys, selector in _selectors(problem):
        if both := sorted(removed & set(selected_units(selector, lattice))):
            held = "clamped" if keys[0] == "supports" else "driven"
            what = f"the void touches the {held} units: it removes unit {lattice.name(both[0])}"
            yield ProblemFault(what, ("void",), f"make it smaller, or move it off the {held} units")


def _void_and_rest(problem: Problem, removed: set[int]) -> Findings:
    lattice = problem.lattice
    if loose := loose_units(lattice, frozenset(removed)):
        origin = f" in {lattice.file}" if isinstance(lattice, ListedNetwork) else ""
        unit = lattice.name(loose[0])
        what = f"the void splits the lattice{origin}: unit {unit} is cut off from the rest"
        remedy = "change its shape, or give `loose: remove` to take such units out as well"
        yield ProblemFault(what, ("void",), remedy)


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
    _units_exist,
    _drive_is_free,
    _one_kind_of_load,
    _horizon,
    _robust,
    _reaction,
    _loads,
    _void,
    _inclusion,
    _target,
    _regions,
    _start_is_feasible,
    _symmetry,
    _optimiser,
)
