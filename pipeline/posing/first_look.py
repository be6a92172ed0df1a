"""Looks at a problem before it is computed: cost, faults of presets, what may not be meant."""

import logging
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import pdist, squareform

from pipeline import problem
from pipeline.posing.perturbed import noises
from pipeline.posing.robust_scene import design_scene, load_family
from pipeline.posing.to_scene import material_of
from pipeline.problem import Problem
from pipeline.problem.sections import (
    SingleDrive,
    Triangular,
    case_count,
    single_drives,
)
from pipeline.runtime import UserError
from sim.core import Floats, Ints
from sim.scene import Scene, estimate_cost, sample_times
from sim.structure import Lattice, Material, polygons

FAR = 0.25
"""Of a displacement, over the length of the lattice."""
BUCKLING = 1.5e-3
"""Likewise, of a push along the rows of a triangular lattice (0.0018 for 8 x 8 hexagons)."""
MANY = 3000
"""Units beyond which necks are not looked for."""
START = 20.0
"""Seconds that a run takes besides its evaluations, on one core."""
SOFT = 0.6
"""Share from which on a unit is too soft to count as rigid: Figure 2's cloak, whose softest has
0.53, was compared with elastic units and has a loss 0.8 % off theirs."""
STATIONS = 24
"""Chords of a unit along its length."""
HELD = 0.08
"""Share of the length at either end where the shim holds the unit."""
STEP = 2e-5
"""Seconds of a step of SQP besides, over the square of the units to redesign: within a factor of
two and a half in the eight studies of a static path."""
FAMILY = 12
"""Simulations of an evaluation for a family of loads, searches and all (Figure 2)."""
AVOIDING = 3
"""Paths that an evaluation costs where snaps are avoided, with its projections (fig6_heart)."""
LATER = {True: (28.0, 13.0), False: (4.0, 0.7)}
"""Evaluations that a case of a sweep costs, and a load case of an imperfect copy, static or not:
measured on Figure 4, and on Figures 2 and 7."""
SLACK = 0.02
"""Of the mass of solid units, by which densities of makers' data sheets may be off."""
_GRAMS = 1e6  # in a tonne
_NAMED = 3  # variants with the same fault that are named
AFTER = 24
"""Evaluations of a motion in time that its steps, its response and their checks cost (fig7)."""


def variant_faults(source: Path, variants: Sequence[str]) -> dict[str, UserError]:
    """Finds the faults of variants of a problem, each once, by the first variant that has it.

    Nothing is solved. The faults of the first variant are told as they are, those of others alone
    with the names of these.

    Args:
        source: the problem file.
        variants: presets, designs, or designs of presets: "quick", "2", "quick.2"; "" for the
            problem itself.
    """
    found: dict[str, tuple[UserError, list[str]]] = {}
    with _without_warnings():
        for variant in variants:
            if (fault := _fault(source, variant)) is not None:
                found.setdefault(str(fault), (fault, []))[1].append(variant)
    for fault, sharing in found.values():
        if sharing[0] != variants[0]:
            fault.what = f"{_listed(source.parent.name, sharing)}: {fault.what}"
    return {sharing[0]: fault for fault, sharing in found.values()}


def _fault(source: Path, variant: str) -> UserError | None:
    try:
        asked = problem.load(source, variant or None)
        design_scene(asked, source.parent)
        load_family(asked, source.parent)
        problem.check_measured_constants(asked, source.parent)
    except UserError as error:
        error.file = error.file or str(source)
        return error
    return None


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Silences warnings of scenes: they do not say which variant they are about."""
    logging.disable(logging.WARNING)
    try:
        yield
    finally:
        logging.disable(logging.NOTSET)


def _listed(study: str, variants: Sequence[str]) -> str:
    """Names variants, without the designs of a preset that is one of them."""
    sharing = [each for each in variants if each.rpartition(".")[0] not in variants]
    named = ", ".join(f"{study}@{each}" for each in sharing[:_NAMED])
    others = len(sharing) - _NAMED
    return f"{named} and {others} more" if others > 0 else named


def cost_line(asked: Problem, scene: Scene) -> str:
    """Says size, unknowns, memory and time to expect of a problem's optimisation."""
    cost = estimate_cost(scene, sample_times(scene))
    optimiser = asked.optimiser
    budget = {name: method.evaluations for name, method in optimiser.methods.chosen.items()}
    if "sqp" in budget:
        first = optimiser.angle.evaluations if optimiser.angle else 0
        budget["sqp"] = optimiser.descents * (first + budget["sqp"])
    evaluations = sum(budget.values())
    seconds = START + (evaluations + (0 if scene.loads.static else AFTER)) * (
        cost.seconds * _simulations(asked)
    )
    seconds += STEP * len(scene.design.cloak) ** 2 * budget.get("sqp", 0)
    return (
        f"{scene.lattice.n_units} units, {len(scene.design.cloak)} of them to redesign;"
        f" {cost.unknowns} unknowns; {len(scene.loads.cases)} load case(s);"
        f" about {max(0.3, cost.memory / 1e9):.2g} GB;"
        f" {evaluations} evaluations of the design, about {_span(seconds)} on one core"
        f"{_followed_by(asked, scene, cost.seconds)}"
    )


def _simulations(asked: Problem) -> int:
    """Counts the simulations of an evaluation, each of all loads of the drive."""
    objective, robust = asked.objective, asked.objective.robust
    copies, others = (1, 0) if robust is None else (max(1, robust.copies), len(robust.loads))
    paths = AVOIDING if objective.snap == "avoid" else 1
    return paths * copies * (1 + others if objective.loads is None else FAMILY)


def _span(seconds: float) -> str:
    units = (("days", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 1.0))
    name, size = next(each for each in units if seconds > 1.5 * each[1] or each[1] == 1.0)
    return f"{seconds / size:.0f} {name}"


def _followed_by(asked: Problem, scene: Scene, evaluation: float) -> str:
    """Tells what is simulated besides, and its time by that of an evaluation, s."""
    constants, made = asked.report.measured_constants, asked.robustness
    cases = 0 if asked.sweep is None else case_count(asked.sweep)
    draws = 0 if constants is None else constants.samples
    copies = 0 if made is None else made.samples * len(noises(made, scene.lattice.spacing))
    parts = {"cases of the sweep": cases, "measured constants": draws, "imperfect copies": copies}
    words = ", ".join(f"{count} {what}" for what, count in parts.items() if count)
    case, copy = LATER[scene.loads.static]
    seconds = ((cases + draws) * case + copies * len(scene.loads.cases) * copy) * evaluation
    return f"; then {words}, about {_span(seconds)}" if words else ""


def doubts(asked: Problem, scene: Scene) -> Iterator[str]:
    """Lists what may not be meant, besides what `check_scene` warns of."""
    if not scene.is_held:
        yield "nothing holds the structure: it can move or turn as one; give `supports`"
    size = float(np.ptp(scene.lattice.vertices, axis=0).max())
    for drive in single_drives(asked.drive):
        push = getattr(drive, "amplitude", 0.0) if drive.unit == "mm" else 0.0
        if push > FAR * size:
            share = push / size
            yield (
                f"the drive goes {push:g} mm, {share:.0%} of the lattice's length; lower"
                " `drive.amplitude` if that is not meant"
            )
        if (
            isinstance(asked.lattice, Triangular)
            and push > BUCKLING * size
            and _inward(drive, scene)
        ):
            yield (
                f"rows of hexagons buckle when they are pushed by {BUCKLING * size:.2g} mm or so,"
                " which no cloak hides: pull them (`drive.directions: [0 deg]`), or push them less"
            )
    yield from _unused_keys(asked)
    yield from _cut_off(asked)
    yield from _shown(asked)
    yield from _picture(asked)
    yield from _mass(asked, scene.lattice)
    yield from _necks(scene.lattice)
    if scene.lattice.n_units <= MANY:
        yield from soft_units(asked, scene.lattice, scene.lattice.vertices)


def soft_units(asked: Problem, lattice: Lattice, vertices: Floats) -> Iterator[str]:
    """Doubts units of a structure, vertices (n_vertices, 2) in mm, that are no rigid bodies."""
    modulus, thickness = asked.report.unit_modulus, asked.fabrication.thickness
    shares = compliance_shares(lattice, vertices, material_of(asked, lattice), modulus, thickness)
    soft = np.flatnonzero(shares > SOFT)
    if len(soft):
        i, j = lattice.index[shares.argmax()]
        yield (
            f"units soft against their ligaments, though they count as rigid: {len(soft)}, the"
            f" softest, at [{i}, {j}], as a beam with {shares.max():.2g} of their compliance; make"
            " them wider (`constraints.edge_length`, `constraints.block_angle`), thicker or stiffer"
            " (`report.unit_modulus`)"
        )


def compliance_shares(
    lattice: Lattice, vertices: Floats, material: Material, modulus: float, thickness: float
) -> Floats:
    """Estimates compliances (n_units,) of the units over those of their stiffest ligaments.

    As a beam of width w, along the line between the two vertices that are farthest apart, a unit
    gives way to forces along it by the integral of 1 / (E t w), to moments at both ends by that of
    12 / (E t w^3), and to a force across it at another vertex, held at both ends, by that of
    12 m^2 / (E t w^3), m the moment of a unit force (Euler-Bernoulli); the largest counts.

    Args:
        lattice: of the units.
        vertices: (n_vertices, 2) of their structure, mm.
        material: of the ligaments.
        modulus: Young's modulus of the units, MPa.
        thickness: of the units, mm.
    """
    axial, bending = (
        np.max(np.asarray(each)) for each in (material.axial_stiffness, material.bending_stiffness)
    )
    place = np.linspace(HELD, 1.0 - HELD, STATIONS)
    shares = np.empty(lattice.n_units)
    for unit, outline in enumerate(polygons(lattice, vertices)):
        corners = vertices[lattice.first_vertex[unit] : lattice.first_vertex[unit + 1]]
        apart = squareform(pdist(corners))
        start, end = corners[list(np.unravel_index(apart.argmax(), apart.shape))]
        along = end - start
        across = np.array([-along[1], along[0]])
        middle = start + place[:, None] * along
        chords = np.stack([middle - across, middle + across], axis=1)
        width = shapely.length(shapely.intersection(shapely.linestrings(chords), outline))
        length = float(np.linalg.norm(along))
        tensile, flexural = 1 / (modulus * thickness * width), 12 / (modulus * thickness * width**3)
        # over what the ligaments give way to the same loads
        found = [
            axial * np.trapezoid(tensile, place) / 2,
            bending * np.trapezoid(flexural, place) / 2,
        ]
        for at in np.clip((corners - start) @ along / length**2, 0.0, 1.0):
            moment = length * np.where(place < at, place * (1 - at), at * (1 - place))
            yielding = axial * np.trapezoid(moment**2 * flexural, place)
            found.append(yielding / (1 + at**2 + (1 - at) ** 2))
        shares[unit] = length * max(found)
    return shares


def _inward(drive: SingleDrive, scene: Scene) -> bool:
    """Tells a drive that pushes its units towards the others in a load case."""
    sites, driven = scene.lattice.site, scene.loads.driven
    outward = sites[driven].mean(axis=0) - sites.mean(axis=0)
    ways = np.array(getattr(drive, "directions", ()))
    return bool((np.cos(ways) * outward[0] + np.sin(ways) * outward[1] < -1e-6).any())


def _unused_keys(asked: Problem) -> Iterator[str]:
    """Doubts keys of other values than by default, which nothing in the problem takes up."""
    moving, avoiding = not asked.static, asked.objective.snap == "avoid"
    twice = "sqp" in asked.optimiser.methods.chosen and asked.contact.law == "geometric"
    cycling = asked.frequency is not None and not asked.measured
    keys = (
        (asked.solver, "solver.accuracy", moving, "motions in time"),
        (asked.solver, "solver.integrator", moving, "motions in time"),
        (asked.response, "response.cycles", cycling, "drives with a frequency"),
        (asked.report, "report.instants", moving, "motions in time"),
        (asked.report, "report.snapshots", not moving, "static paths"),
        (asked.objective, "objective.snap_margin", avoiding, "`objective.snap: avoid`"),
        (asked.optimiser, "optimiser.angle", twice, "SQP with contact on distance"),
    )
    for section, key, used, what in keys:
        name = key.rpartition(".")[2]
        if not used and getattr(section, name) != type(section).model_fields[name].default:
            yield f"`{key}` does nothing: it is for {what} alone; leave it out"


def _cut_off(asked: Problem) -> Iterator[str]:
    """Doubts loads of `robust.loads` slower than the drive, whose motion is judged in part."""
    robust, wanted = asked.objective.robust, asked.horizon.periods
    if robust is None or wanted is None:
        return
    for number, load in enumerate(robust.loads):
        periods = wanted if load.frequency is None else load.frequency * asked.horizon_time
        if periods < wanted * (1 - 1e-6):
            yield (
                f"`objective.robust.loads[{number}].frequency`: the loss counts {periods:.3g}"
                f" periods of it and not {wanted:g}, as all loads are judged over the drive's"
                f" {asked.horizon_time:.3g} s; raise `horizon.periods`, or take the lowest"
                " frequency for the drive's own"
            )


def _shown(asked: Problem) -> Iterator[str]:
    """Doubts what a report is to show and the response does not reach."""
    first = single_drives(asked.drive)[0]
    name, end, unit = "instants", asked.response_time, "s"
    if asked.static:
        name, end, unit = "snapshots", getattr(first, "amplitude", math.inf), first.unit
    listed: tuple[float, ...] = getattr(asked.report, name)
    if beyond := [each for each in listed if each > end * (1 + 1e-6)]:
        yield (
            f"the response ends at {end:.4g} {unit}, which is shown for {beyond[0]:g} as well;"
            f" mend `report.{name}`"
        )
    if asked.static and listed and unit != "mm":
        yield f"`report.snapshots` are lengths, and are taken as {unit}: the drive is no length"


def _picture(asked: Problem) -> Iterator[str]:
    """Doubts a picture that shows more than one outline, or removes its own corners."""
    void = asked.void
    if void is None or void.image is None:
        return
    drawn = void.outlines(asked.lattice.centre_site)
    if len(drawn) > 1:
        yield (
            f"{void.image.file} shows {len(drawn)} outlines, one within another or beside it: units"
            " within an odd number of them go; if the ground is dark, give `invert: true`"
        )


def _mass(asked: Problem, lattice: Lattice) -> Iterator[str]:
    """Doubts a density that units moving in time cannot have as they are made."""
    if asked.static:
        return
    made, share = asked.fabrication, asked.solid_share
    area = float(shapely.area(polygons(lattice, lattice.vertices)).sum())
    mass = asked.material.density * area * _GRAMS
    solid, infill = mass / share, made.print.infill or 0.0
    told = f"the units weigh {mass:.3g} g in the simulation, but as made of"
    told += f" {made.material}, {made.thickness:g} mm thick,"
    if share > 1.0 + SLACK:
        yield (
            f"{told} {solid:.3g} g even if solid; give"
            f" `fabrication.thickness: {share * made.thickness:.3g} mm` or more, another"
            " `fabrication.material`, or"
            f" `material.density: {asked.material.density / share * 1e9:.3g} kg/m^2` or less"
        )
    elif share < (1.0 - SLACK) * infill:
        yield (
            f"{told} {infill * solid:.3g} g at least with `fabrication.print.infill`"
            f" {infill:g}; give {share:.2g} there, or leave it out"
        )


def _necks(lattice: Lattice) -> Iterator[str]:
    """Doubts a lattice that a single unit holds together."""
    if lattice.n_units > MANY:
        return
    one, other = lattice.ligament_units.T
    count = np.bincount(lattice.ligament_units.ravel(), minlength=lattice.n_units)
    thin = [
        unit
        for unit in np.flatnonzero((count > 1) & (count < count.max())).tolist()
        if _pieces_without(unit, one, other, lattice.n_units)
    ]
    if thin:
        i, j = lattice.index[thin[0]]
        yield (
            f"necks of one unit: {len(thin)}, the first at [{i}, {j}]; without it a part hangs on"
            " nothing: move or shrink the void if that is not meant"
        )


def _pieces_without(unit: int, one: Ints, other: Ints, n_units: int) -> bool:
    kept = (one != unit) & (other != unit)
    ends = (one[kept], other[kept])
    joined = coo_array((np.ones(kept.sum(), dtype=bool), ends), shape=(n_units, n_units))
    _, piece = connected_components(joined, directed=False)
    sizes = np.bincount(np.delete(piece, unit))
    return int(np.count_nonzero(sizes)) > 1
