"""Describes the numbers of a report along a path, each computed from the datasets.

A publication's words for them stand in the problem, under `report.paper.values`, by their key.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
import xarray as xr

from pipeline.comparison import middle_units
from pipeline.problem import Problem
from pipeline.problem.sections import (
    HarmonicDrive,
    Quads,
    RampHarmonicDrive,
    Region,
    TanhRampDrive,
    resolve_centre,
    single_drives,
)
from reports.facts import (
    Fact,
    checks,
    constants_facts,
    copies,
    facts_of,
    grouped,
    loss_formula,
    recording_facts,
    worded,
)
from reports.figures.loading_path import contact_comparison, measured, measures, monte_carlo
from reports.figures.loading_path.abscissa import (
    LOADS,
    Abscissa,
    abscissa_of,
    driven_side,
    drives_side,
    lattice_size,
    load_kind,
    load_names,
    structures,
)
from reports.figures.loading_path.drive_response import drive_response
from reports.figures.loading_path.measures import over_cases
from reports.study import StudyResults, display_name, from_dataset
from sim.core import Floats

BRANCHED = 3
"""Flag of a stable state that the path came to from where it branches."""

_told = facts_of(__file__)


def loading_path_facts(study: StudyResults) -> list[Fact]:
    """Returns all facts, under headings."""
    path = abscissa_of(study.problem, study.response)
    return [
        *grouped("Scene", scene_facts(study, path)),
        *grouped("Result", measure_facts(study, path)),
        *grouped("Measured", measured.measured_facts(study, path)),
        *recording_facts.recorded_facts(study.recordings),
        *grouped("Loss", loss_facts(study, path)),
        *grouped("Lateral contraction", contraction_facts(study, path)),
        *grouped("Reaction", reaction_facts(study, path)),
        *grouped("Optimisation", checks.history_facts(study.problem, study.design)),
        *grouped("Checks of the design", checks.design_facts(study.design)),
        *grouped(
            "Checks along the path", checks.path_facts(study.problem, study.design, study.response)
        ),
        *grouped("Contact", contact_comparison.contact_facts(study)),
        *grouped("Load steps", checks.variant_facts(study.verification)),
        *grouped("Imperfect copies", copy_facts(study)),
        *grouped(
            "With the constants’ measured spread",
            constants_facts(study.problem, study.constants, mean_losses(study)),
        ),
    ]


def scene_facts(study: StudyResults, path: Abscissa) -> Iterator[Fact]:
    """Yields the problem as it was run."""
    problem, response = study.problem, study.response
    lattice, paper = problem.lattice, problem.report.paper
    if paper is not None and paper.variant:
        yield _told("variant", np.nan, paper.variant, figure=paper.figure)
    initial = from_dataset(study.design, lattice.spacing, "vertices_initial")
    yield _told("units", lattice.n_units, lattice_size(lattice))
    yield _told("spacing", lattice.spacing)
    if isinstance(lattice, Quads):
        yield checks.bias_fact(initial)
    yield _told("ligament_length", lattice.ligament_length)
    removed = initial.n_units - int(from_dataset(study.design, lattice.spacing).present.sum())
    if removed:
        yield _told("removed_units", removed)
    yield _told("cloak_units", int((response["region"] == 1).sum()))
    yield _told("interest_units", int(response["roi"].sum()))
    yield from _radii(problem)
    if path.static:
        yield _load_fact(path)
        if path.displaces:
            yield from strain_facts(problem, path)
        loads = problem.horizon.steps or problem.horizon.samples
        smooth = any(isinstance(drive, TanhRampDrive) for drive in single_drives(problem.drive))
        time = " in time, not in displacement" * smooth
        yield _told("load_steps", loads, time=time)
    else:
        if isinstance(problem.drive, HarmonicDrive | RampHarmonicDrive):
            yield _told("amplitude", problem.drive.amplitude, name="Amplitude A", unit="mm")
            yield _told("frequency", problem.drive.frequency)
        yield _told("horizon", problem.horizon_time)


def _radii(problem: Problem) -> Iterator[Fact]:
    """Tells how far round regions reach."""
    spacing = problem.lattice.spacing
    for key, region in (
        ("interest_radius", problem.objective.region),
        ("void_radius", problem.void),
        ("cloak_radius", problem.cloak),
    ):
        bounds = region.bounds if isinstance(region, Region) else None
        if bounds is not None:
            yield _told(key, bounds[2], spacings=bounds[2] / spacing)
    width = _cloak_width(problem)
    if width is not None:
        yield _told("cloak_width", width, spacings=width / spacing)


def _cloak_width(problem: Problem) -> float | None:
    """Finds the least width of a cloak around a void, an inclusion or a region of interest, mm."""
    if problem.cloak.around is not None:
        return problem.cloak.around.distance
    if problem.cloak.bounds is None:
        return None
    middle = problem.lattice.centre_site
    centre, inner, outer = problem.cloak.bounds
    around = resolve_centre(centre, middle)
    inclusion = problem.inclusion and problem.inclusion.region
    for region in (problem.void, inclusion, problem.objective.region):
        if isinstance(region, Region):
            ends = [point for outline in region.outlines(middle) for point in outline]
            inner = max([inner, *(math.dist(point, around) for point in ends)])
    return round(outer - inner, 9) if 0.0 < inner < outer else None


def _load_fact(path: Abscissa) -> Fact:
    note = "of the driven units, along the drive" if path.displaces else "on the driven units"
    if path.strain is not None:
        note += f"; the paper labels it ε = {100 * path.strain:g} %"
    return _told("amplitude", float(path.values[-1]), name=path.name, unit=path.unit, note=note)


def strain_facts(problem: Problem, path: Abscissa) -> Iterator[Fact]:
    """Yields the strain along the line from the middle to the driven side, a row for each kind.

    There is none of several drives that displace: the others' sides move as well; and none of a
    drive of units within the lattice.
    """
    if not drives_side(problem):
        return
    if sum(drive.kind not in LOADS for drive in single_drives(problem.drive)) > 1:
        return
    _, axis = driven_side(problem)
    span = float(np.ptp([site[1 + axis] for site in problem.lattice.sites()]))
    angles = np.degrees(getattr(problem.drive, "directions", ()) or (np.pi,))
    words = {"span": worded(span, "mm", 4), "ends": ("columns", "rows")[axis]}
    kinds = dict.fromkeys(load_kind(problem, float(angle)) for angle in angles)
    for place, kind in enumerate(kinds):
        key = "strain" if place == 0 else f"strain_{kind}"
        yield _told(
            "{key}", float(path.values[-1]) / span, key=key, kind=kind.capitalize(), **words
        )


def _each(
    study: StudyResults,
    key: str,
    values: xr.DataArray,
    names: Iterable[str] = ("altered", "cloaked"),
    /,
    **words: object,
) -> Iterator[Fact]:
    """Yields a fact of each structure, of values (structure,): the words `key`_{structure}."""
    mean = ["weighted mean of the load cases"] if study.response.sizes["case"] > 1 else []
    for name in names:
        shown = display_name(study.problem, name).lower()
        value = float(values.sel(structure=name))
        fact = _told(f"{key}_{{structure}}", value, structure=name, shown=shown, **words)
        yield replace(fact, note="; ".join([*filter(None, [fact.note]), *mean]))


def measure_facts(study: StudyResults, path: Abscissa) -> Iterator[Fact]:
    """Yields the measure of path or motion, and its reduction by the cloak."""
    measure = measures.measure_of(study.problem)
    each = measure.of(study.response)
    values = over_cases(study.problem, each)
    where = f"at {path.at(-1)}" if path.static else "root mean square over the time shown"
    whole = measures.overall(study.problem, values)
    of = {"key": measure.key, "what": measure.label, "unit": measure.unit}
    of_cases = measures.overall(study.problem, each)
    several = each.sizes["case"] > 1
    mean = ", of the weighted mean of the load cases" * several
    for name in ("altered", "cloaked"):
        told = {"where": where, "formula": measure.formula}
        yield from _each(study, "{key}", whole, [name], **of, **told)
        key = f"{measure.key}_{name}"
        yield from _each_load(study, key, measure.label, of_cases, name, measure.unit)
    altered, cloaked = (values.sel(structure=name) for name in ("altered", "cloaked"))
    gain = 1.0 - float(whole.sel(structure="cloaked") / whole.sel(structure="altered"))
    yield _told("{key}_reduction", gain, key=measure.key, what=measure.label, note=where)
    if path.static:
        gains = (1.0 - cloaked / altered).isel(time=slice(altered.sizes["time"] // 2, None))
        least = float(gains.min())
        told = {"key": measure.key, "what": measure.label}
        yield _told("{key}_reduction_least", least, mean=mean, **told)
    # a mean over load cases would hide the case with the largest
    most = float(each.sel(structure="cloaked").max())
    note = "the largest on the whole path" if path.static else "the largest at any time"
    note += " of any load case" * several
    yield _told("{key}_cloaked_most", most, note=note, **of)


def _each_load(
    study: StudyResults, key: str, label: str, values: xr.DataArray, name: str, unit: str
) -> Iterator[Fact]:
    """Yields a row for each of several load cases, whose mean the row above is."""
    loads = load_names(study.problem, study.response)
    part = values.sel(structure=name)
    ends = part.isel(time=-1) if "time" in part.dims else part
    of = {"key": key, "shown": display_name(study.problem, name).lower(), "unit": unit}
    for case, load in enumerate(loads if len(loads) > 1 else ()):
        yield _told("{key}_case{case}", float(ends[case]), case=case, load=load, of=label, **of)


def loss_facts(study: StudyResults, path: Abscissa) -> Iterator[Fact]:
    """Yields the loss that was minimised, before and after."""
    unit = "N mm" if study.problem.objective.kind == "strain_energy" else "1"
    start, end = mean_losses(study)
    for key, name, value in (("start", "altered", start), ("end", "cloaked", end)):
        shown = display_name(study.problem, name).lower()
        formula = loss_formula(study.problem)
        yield _told("loss_{key}", value, key=key, shown=shown, unit=unit, formula=formula)
        yield from _each_load(study, f"loss_{key}", "Loss", study.response["loss"], name, unit)
    yield _told("loss_reduction", 1.0 - end / start)
    yield from _snap_facts(study, path, end, unit)
    yield from checks.error_facts(study.response, "relative; the largest of all structures")


def mean_losses(study: StudyResults) -> tuple[float, float]:
    """Returns mean losses of the altered structure and of the design over their load cases."""
    loss = over_cases(study.problem, study.response["loss"])
    start, end = (float(loss.sel(structure=name)) for name in ("altered", "cloaked"))
    return start, end


def _snap_facts(study: StudyResults, path: Abscissa, loss: float, unit: str) -> Iterator[Fact]:
    """Yields where the cloaked structure snaps, and its losses where the path branches."""
    part = study.response.sel(structure="cloaked")
    of_ways, each = part["snap"].values, part["snap_load"].values
    known = each if np.isfinite(each).any() else of_ways  # a response of an older version
    loads = np.unique(known[np.isfinite(known)])
    if not len(loads):
        return

    def places(loads: Floats) -> tuple[float, str]:
        found = np.interp(loads, part["time"].values, path.values)
        words = " and ".join(worded(float(place), path.unit, 3) for place in found)
        return float(found[0]), words

    losses = over_cases(study.problem, study.response["loss_other_branch"])
    other = float(losses.sel(structure="cloaked"))
    words, note = worded(loss, unit, 3), "at a limit point; the loss is that after it"
    if (part["stability"] >= BRANCHED).any():
        note = "where the path branches; the loss on the branch that it was followed along"
    if np.isfinite(other):
        words += f" or {worded(other, unit, 3)}"
        note = "where the path branches; the loss on either branch"
    turns = _turns(part["traced_load"].values)
    if len(turns):
        note += f"; traced by arc length, the path that it leaves turns at {places(turns)[1]}"
    first, where = places(loads)
    yield _told("snaps", first, f"snaps at {where}: {words}", unit=path.unit, note=note)


def _turns(loads: Floats) -> Floats:
    """Lists loads at which traced paths (n_cases, n_points) turn back or forward again."""
    paths = [each[np.isfinite(each)] for each in loads]
    return np.concatenate(
        [each[1:-1][np.diff(np.sign(np.diff(each))) != 0.0] for each in paths] or [np.zeros(0)]
    )


def contraction_facts(study: StudyResults, path: Abscissa) -> Iterator[Fact]:
    """Yields change of the vertical distance between top and bottom rows."""
    if not path.static or not measures.contracts_freely(study.problem, study.response):
        return
    every = over_cases(study.problem, measures.contraction(study.problem, study.response))
    nearer, count = every.isel(time=-1), len(middle_units(study.problem, "top"))
    yield from _each(study, "contraction", nearer, structures(study.response), count=count)
    if "intact" in structures(study.response):
        off = nearer / float(nearer.sel(structure="intact")) - 1.0
        yield from _each(study, "contraction_error", off)


def reaction_facts(study: StudyResults, path: Abscissa) -> Iterator[Fact]:
    """Yields what the units of the drive answer with at the end of the path."""
    if not path.static:
        return
    names, where = structures(study.response), path.at(-1)
    response = drive_response(study.problem)
    every = response.of(study.response)
    ends = over_cases(study.problem, every).isel(time=-1)
    for name in names:
        key = response.key
        yield from _each(study, key, ends, [name], where=where)
        yield from _each_load(study, f"{key}_{name}", response.title, every, name, response.unit)
    if "intact" in names and response.held:
        off = over_cases(study.problem, measures.reaction_error(every))
        yield from _each(study, "reaction_error", off)


def copy_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields what 95 % of the imperfect copies keep to, and the spread of the measure."""
    if study.scatter is None:
        return
    measure = measures.measure_of(study.problem)
    values = monte_carlo.copy_curves(study.problem, measure, study.response, study.scatter)
    found = copies.spreads(measures.overall(study.problem, values), study.scatter)
    key = f"{measure.key}_cloaked"
    yield from copies.worst_copy_fact(key, measure.label, measure.unit, found)
    yield from copies.spread_facts(measure.label, measure.unit, found)
