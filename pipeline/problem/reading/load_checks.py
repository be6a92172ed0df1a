"""Checks loads: drives against supports and one another, their courses, loads in ranges."""

from collections.abc import Iterator
from dataclasses import replace
from math import atan2, ceil, hypot, isclose

from pipeline.problem import Problem
from pipeline.problem.reading.fault import Findings, ProblemFault
from pipeline.problem.reading.yaml_file import KeyPath
from pipeline.problem.sections import (
    DisplacementDrive,
    ForceDrive,
    LinearRampDrive,
    ListedNetwork,
    LoadRanges,
    Selector,
    SeveralDrives,
    SingleDrive,
    TanhRampDrive,
    TestSetup,
    TorqueDrive,
    selected_units,
    single_drives,
)

LEAST_SAMPLES = 6
"""Instants in a period of a load, of loss and response: of fewer these show something else."""

_HAIR = 1e-9

_ALIKE = 1e-6
"""Relative difference up to which a value is the drive's: that of a mixture has no end."""


def selectors_of(problem: Problem) -> Iterator[tuple[KeyPath, Selector]]:
    """Lists the selectors of supports and drives, with their keys."""
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


def units_exist(problem: Problem) -> Findings:
    """Finds units that the lattice does not have."""
    for keys, selector in selectors_of(problem):
        try:
            selected_units(selector, problem.lattice)
        except IndexError as error:
            yield ProblemFault(str(error), keys, problem.lattice.extent)


def drive_is_free(problem: Problem) -> Findings:
    """Finds units that are driven and clamped, or driven twice."""
    others: list[tuple[set[int], SingleDrive]] = []
    for keys, drive in _drives(problem):
        driven = set(selected_units(drive.units, problem.lattice))
        for support in problem.supports:
            both = sorted(driven & set(selected_units(support.units, problem.lattice)))
            if both and not set(drive.acting).isdisjoint(support.clamp):
                what = f"unit {problem.lattice.name(both[0])} is driven and clamped"
                yield ProblemFault(what, (*keys, "units"), "drive or clamp it, not both")
        for units, other in others:
            if (both := sorted(driven & units)) and (dof := _shared_dof(drive, other)):
                what = f"unit {problem.lattice.name(both[0])} is driven twice, along {dof}"
                remedy = "give every unit to one drive, or let the others' way be `free`"
                yield ProblemFault(what, (*keys, "units"), remedy)
        others.append((driven, drive))


def _shared_dof(one: SingleDrive, other: SingleDrive) -> str | None:
    """Names a degree of freedom that one of two drives moves and the other does not leave free."""
    held = [{"ux", "uy", "theta"} - set(drive.free) for drive in (one, other)]
    moved = [set(drive.acting) for drive in (one, other)]
    return min(held[0] & moved[1] | held[1] & moved[0], default=None)


def prescribed_units(problem: Problem) -> set[int]:
    """Lists the ids of units of which no degree of freedom is left: clamped, or displaced."""
    held = [(support.units, set(support.clamp)) for support in problem.supports]
    for drive in single_drives(problem.drive):
        gives_way = drive.acting if isinstance(drive, ForceDrive | TorqueDrive) else ()
        held.append((drive.units, set(drive.prescribed) - set(gives_way)))
    found: dict[int, set[str]] = {}
    for selector, dofs in held:
        for unit in selected_units(selector, problem.lattice):
            found.setdefault(unit, set()).update(dofs)
    return {unit for unit, dofs in found.items() if len(dofs) == 3}


def one_kind_of_load(problem: Problem) -> Findings:
    """Finds slow loads beside fast ones, and forces where displacements are asked for."""
    kinds = single_drives(problem.drive)
    if len(kinds) > 1 and not problem.static:
        slow = [d.kind for d in kinds if problem.model_copy(update={"drive": d}).static]
        if slow:
            what = f"a {slow[0]} is a slow load, and another of the drives is not"
            yield ProblemFault(what, ("drives",), "give all of them a course in time, or none")


def spectrum(problem: Problem) -> Findings:
    """Finds drives to which there is no transmission of a displacement, lattices without a cell."""
    if problem.spectrum is not None and isinstance(problem.lattice, ListedNetwork):
        what = "a lattice from a file has no unit cell to send waves through"
        yield ProblemFault(what, ("spectrum",), "leave the section out")
    if problem.spectrum is not None and not isinstance(problem.drive, DisplacementDrive):
        kind = "several drives" if isinstance(problem.drive, SeveralDrives) else problem.drive.kind
        what = f"a spectrum is that of one displacement along a line, not of {kind}"
        yield ProblemFault(what, ("spectrum",), "leave it out, or drive by a displacement")


def _steps_of(problem: Problem) -> bool:
    """Tells a path whose loads can be equal steps."""
    return all(
        isinstance(drive, LinearRampDrive) or getattr(drive, "static", False)
        for drive in single_drives(problem.drive)
    )


def horizon(problem: Problem) -> Findings:
    """Finds periods and steps that the drive does not have."""
    if problem.horizon.periods is not None and problem.frequency is None:
        what = f"a {problem.drive.kind} drive has no period"
        yield ProblemFault(what, ("horizon", "periods"), 'give `duration`, e.g. "1 s"')
    if problem.horizon.steps is not None and not _steps_of(problem):
        what = f"a {problem.drive.kind} drive does not load in equal steps"
        yield ProblemFault(what, ("horizon", "steps"), "drive by a linear_ramp, or give `samples`")


def ramps_end(problem: Problem) -> Findings:
    """Finds ramps of a static path that do not reach their amplitude at its very end."""
    end = problem.horizon_time
    for keys, drive in _drives(problem):
        if not problem.static or not isinstance(drive, LinearRampDrive | TanhRampDrive):
            continue
        if not isclose(drive.duration, end):
            what = f"the ramp lasts {drive.duration:g} s, and the load path {end:g} s"
            remedy = "give both one duration; to load less or more, change `amplitude`"
            yield ProblemFault(what, (*keys, "duration"), remedy)


def drive_comes(problem: Problem) -> Findings:
    """Finds drives that come after the horizon: nothing moves until its end."""
    end = problem.horizon_time
    for keys, drive in _drives(problem):
        grows = getattr(drive, "width", None) or getattr(drive, "rise_time", None) or 0.0
        if (begin := getattr(drive, "delay", 0.0) - grows) > end:
            what = f"the drive comes at {begin:g} s, after the horizon, which ends at {end:g} s"
            yield ProblemFault(what, (*keys, "delay"), "lower it, or lengthen the horizon")


def samples(problem: Problem) -> Findings:
    """Finds instants that are too far apart to see a load, which comes and goes between them."""
    spans = {
        "horizon": (problem.horizon_time, problem.horizon.samples),
        "response": (problem.response_time, problem.response.samples),
    }
    for _, drive in _drives(problem):
        frequency, width = (getattr(drive, name, None) for name in ("frequency", "width"))
        if frequency is not None:
            longest, named = 1.0 / (LEAST_SAMPLES * frequency), f"a period of {1 / frequency:g} s"
        elif width is not None:
            longest, named = width, f"a push that is {width:g} s wide"
        else:
            continue
        for section, (time, count) in spans.items():
            least = ceil((1.0 - _HAIR) * time / longest)
            if count < least:
                what = f"{count} samples in {time:g} s are too few to see {named}"
                yield ProblemFault(what, (section, "samples"), f"give {least} or more")
                break


def reaction(problem: Problem) -> Findings:
    """Finds why the force of the drive cannot be mimicked."""
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


def loads_in_ranges(problem: Problem) -> Findings:
    """Finds what a family of loads cannot be of, or cannot be minimised over."""
    objective = problem.objective
    if (family := objective.loads) is None:
        return
    place = ("objective", "loads")
    yield from _ranges(problem, family, place)
    yield from drive_is_free(_turned(problem, family))
    for index, setup in enumerate(family.setups):
        posed, keys = problem.in_setup(setup), (*place, "setups", index)
        turned = _turned(posed, setup)
        for check in (units_exist, drive_is_free, one_kind_of_load, horizon, ramps_end):
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
    if problem.optimiser.descents > 1:
        what = "descents under loads in ranges end with loads of their own, and cannot be compared"
        yield ProblemFault(what, ("optimiser", "descents"), "give 1")
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
    if isinstance(drive, SeveralDrives) and not _are_two_ramps(drive):
        what = "loads in ranges are mixtures of two slow displacements"
        yield ProblemFault(what, place, "give two ramps, of one direction each")
    elif not isinstance(drive, SeveralDrives | DisplacementDrive):
        what = f"a drive of the kind {drive.kind} has no displacement and direction to vary"
        yield ProblemFault(what, place, "leave it out, or displace units along a direction")
    elif ranges.frequency is not None and problem.frequency is None:
        of = "two ramps have" if drive.kind == "several" else f"a {drive.kind} drive has"
        yield ProblemFault(f"{of} no frequency to vary", (*place, "frequency"), "leave it out")
    elif ranges.frequency is not None and problem.horizon.periods is None:
        what = "a time does not fit loads of all frequencies"
        yield ProblemFault(what, ("horizon", "duration"), "give `periods`")
    else:
        yield from _single_values(_own_loads(problem, drive), ranges, place)


def _are_two_ramps(drive: SeveralDrives) -> bool:
    ramps = [isinstance(part, LinearRampDrive | TanhRampDrive) for part in drive.drives]
    return ramps == [True, True] and len(drive.case_weights) == 1


def _own_loads(
    problem: Problem, drive: SeveralDrives | DisplacementDrive
) -> dict[str, tuple[float, ...]]:
    """Lists directions (rad), amplitudes (mm) and frequencies (Hz) of the drive's own loads.

    Those of two drives are of their mixture.
    """
    frequency = () if problem.frequency is None else (problem.frequency,)
    if isinstance(drive, DisplacementDrive):
        own = {"directions": drive.directions, "amplitude": (drive.amplitude,)}
        return own | {"frequency": frequency}
    first, second = (getattr(part, "amplitude", 0.0) for part in drive.drives)
    mixed = {"directions": (atan2(second, first),), "amplitude": (hypot(first, second),)}
    return mixed | {"frequency": frequency}


def _single_values(
    own: dict[str, tuple[float, ...]], ranges: LoadRanges | TestSetup, place: KeyPath
) -> Findings:
    """Finds ranges of one value that the drive does not have: its own loads are of the family."""
    for name, values in own.items():
        low, high = getattr(ranges, name) or (0.0, 1.0)
        if low == high and not all(isclose(value, low, rel_tol=_ALIKE) for value in values):
            what = "one value, which is not the drive's"
            yield ProblemFault(what, (*place, name), "give the drive's, or a range that has it")
