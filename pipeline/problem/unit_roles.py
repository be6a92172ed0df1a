"""Selects units by their part in a problem: removed, made rigid, redesigned, looked at."""

from pipeline.problem.model import Problem
from pipeline.problem.sections import (
    Region,
    loose_units,
    selected_units,
    single_drives,
    units_near,
    units_within,
)


def void_units(problem: Problem) -> tuple[int, ...]:
    """Lists the ids of units that the void removes, and of those it cuts loose if they go too."""
    if problem.void is None:
        return ()
    inside = units_within(problem.void, problem.lattice)
    if problem.void.loose == "refuse":
        return inside
    return tuple(sorted({*inside, *loose_units(problem.lattice, frozenset(inside))}))


def inclusion_units(problem: Problem) -> tuple[int, ...]:
    """Lists the ids of the units that are made rigid."""
    inclusion = problem.inclusion
    return () if inclusion is None else units_within(inclusion.region, problem.lattice)


def altered_units(problem: Problem) -> set[int]:
    """Lists the ids of the units that are removed or made rigid: neither cloak nor surroundings."""
    return {*void_units(problem), *inclusion_units(problem)}


def driven_units(problem: Problem) -> tuple[int, ...]:
    """Lists the ids of the units that any drive moves, ascending."""
    every = (selected_units(drive.units, problem.lattice) for drive in single_drives(problem.drive))
    return tuple(sorted(set().union(*every)))


def drive_groups(problem: Problem) -> tuple[tuple[int, ...], ...]:
    """Groups the ids of driven units that the same drives move: others move otherwise."""
    drives = single_drives(problem.drive)
    moved = [set(selected_units(drive.units, problem.lattice)) for drive in drives]
    groups: dict[tuple[bool, ...], list[int]] = {}
    for unit in driven_units(problem):
        groups.setdefault(tuple(unit in each for each in moved), []).append(unit)
    return tuple(map(tuple, groups.values()))


def source_units(problem: Problem) -> tuple[int, ...]:
    """Lists the ids of driven units within the cloak: they keep their shape to fit the drive."""
    return tuple(sorted(set(driven_units(problem)) & set(_cloak_inside(problem))))


def cloak_units(problem: Problem) -> tuple[int, ...]:
    """Lists the ids of the units to design: the cloak's that nothing else claims."""
    taken = {*driven_units(problem), *altered_units(problem)}
    if isinstance(problem.objective.region, Region):
        taken |= set(units_within(problem.objective.region, problem.lattice))
    return tuple(unit for unit in _cloak_inside(problem) if unit not in taken)


def _cloak_inside(problem: Problem) -> tuple[int, ...]:
    """Lists the ids of all units within the cloak's outer rim."""
    if problem.cloak.around is None:
        return units_within(problem.cloak, problem.lattice)
    cores = _cores(problem)
    found = (units_near(core, problem.cloak.around.distance, problem.lattice) for core in cores)
    return tuple(sorted(set().union(*found)))


def _cores(problem: Problem) -> list[Region]:
    """Lists the core of a cloak: the region of interest, if there is one, or what was altered."""
    if isinstance(problem.objective.region, Region):
        return [problem.objective.region]
    inclusion = None if problem.inclusion is None else problem.inclusion.region
    return [region for region in (problem.void, inclusion) if region is not None]


def interest_units(problem: Problem) -> tuple[int, ...]:
    """Lists the ids of the units that the objective looks at.

    Driven units are no surroundings to keep at rest, but they belong to those that are mimicked.
    """
    taken = altered_units(problem)
    if isinstance(problem.objective.region, Region):
        inside = units_within(problem.objective.region, problem.lattice)
        return tuple(unit for unit in inside if unit not in taken)
    taken |= set(cloak_units(problem))
    if problem.objective.target == "rest":
        taken |= set(driven_units(problem))
    return tuple(unit for unit, _, _ in problem.lattice.sites() if unit not in taken)
