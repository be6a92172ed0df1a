"""Checks regions: void, inclusion, cloak and region of interest against lattice and supports."""

from pipeline.problem import Problem, cloak_units, inclusion_units, interest_units, void_units
from pipeline.problem.reading.fault import Findings, ProblemFault
from pipeline.problem.reading.load_checks import prescribed_units, selectors_of
from pipeline.problem.reading.yaml_file import KeyPath
from pipeline.problem.sections import (
    ListedNetwork,
    Region,
    loose_units,
    resolve_centre,
    selected_units,
)


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
        yield ProblemFault(what, (*keys, shape, "centre"), _sites_range(problem))
    elif outer > room:
        what = f"{keys[0]} of radius {outer:g} mm reaches beyond the lattice"
        remedy = f"keep it within {room:g} mm of its centre ({x:g}, {y:g}) mm"
        yield ProblemFault(what, (*keys, shape, key), remedy)
    elif inner >= outer:
        what = f"the ring's inner radius ({inner:g} mm) is not below the outer ({outer:g} mm)"
        yield ProblemFault(what, (*keys, shape, "inner"), f"keep it below {outer:g} mm")


def regions(problem: Problem) -> Findings:
    """Finds regions that do not fit the lattice or hold no unit."""
    if problem.void is not None:
        yield from _region_fits(problem, problem.void, ("void",))
    if problem.inclusion is not None:
        yield from _region_fits(problem, problem.inclusion.region, ("inclusion", "region"))
    if isinstance(problem.objective.region, Region):  # then the cloak may lie around it
        yield from (*_interest(problem), *_cloak(problem))
    else:  # then it is what the cloak leaves
        yield from (*_cloak(problem), *_interest(problem))


def _remedy(problem: Problem) -> str:
    return f"enlarge it, or move its centre: {_sites_range(problem)}"


def _sites_range(problem: Problem) -> str:
    _, across, up = zip(*problem.lattice.sites(), strict=True)
    x, y = (f"from {min(each):.4g} to {max(each):.4g} mm" for each in (across, up))
    return f"the sites lie at x {x} and y {y}"


def _cloak(problem: Problem) -> Findings:
    yield from _region_fits(problem, problem.cloak, ("cloak",))
    if not cloak_units(problem):
        what = "no unit lies in the cloak (driven units and the region of interest are left out)"
        yield ProblemFault(what, ("cloak",), _remedy(problem))


def _interest(problem: Problem) -> Findings:
    if isinstance(problem.objective.region, Region):
        yield from _region_fits(problem, problem.objective.region, ("objective", "region"))
    if not (looked_at := set(interest_units(problem))):
        what = "no unit lies in the region of interest"
    elif _is_decided(problem, looked_at):
        what = (
            "clamps and drives prescribe the motion of all units of interest: no design alters it"
        )
    else:
        return
    if problem.objective.region == "surroundings":
        yield ProblemFault(what, ("cloak",), "leave units outside it")
    else:
        yield ProblemFault(what, ("objective", "region"), _remedy(problem))


def _is_decided(problem: Problem, looked_at: set[int]) -> bool:
    """Tells motions that are compared, and are the same for every design."""
    objective = problem.objective
    compared = objective.kind == "displacement" and objective.reaction is None
    return compared and looked_at <= prescribed_units(problem)


def void(problem: Problem) -> Findings:
    """Finds a void without units, or that cuts off what has to stay."""
    if problem.void is None:
        return
    removed = void_units(problem)
    if not removed:
        yield ProblemFault("no unit lies in the void", ("void",), _remedy(problem))
    yield from _void_and_supports(problem, set(removed))
    yield from _void_and_rest(problem, set(removed))


def inclusion(problem: Problem) -> Findings:
    """Finds an inclusion without units, or that the void cuts."""
    if problem.inclusion is None:
        return
    stiff = set(inclusion_units(problem))
    if not stiff:
        what = "no unit lies in the inclusion"
        yield ProblemFault(what, ("inclusion", "region"), _remedy(problem))
    if both := sorted(stiff & set(void_units(problem))):
        what = f"unit {problem.lattice.name(both[0])} is in the void and in the inclusion"
        yield ProblemFault(what, ("inclusion", "region"), "keep the two apart")


def target(problem: Problem) -> Findings:
    """Finds a target that the objective cannot have."""
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
    for keys, selector in selectors_of(problem):
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
