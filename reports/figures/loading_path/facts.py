"""Describes the numbers of a report along a path, each computed from the datasets.

A publication's words for them stand in the problem, under `report.paper.values`, by their key.
"""

import re
from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from pipeline.comparison import middle_units
from pipeline.problem import Problem
from pipeline.problem.sections import HarmonicDrive, Quads, RampHarmonicDrive, Region
from reports.facts import (
    ABSENT,
    Fact,
    checks,
    constants_facts,
    grouped,
    number,
    recording_facts,
    share,
    worded,
)
from reports.figures.loading_path import contact_comparison, measured, measures, monte_carlo
from reports.figures.loading_path.abscissa import (
    Abscissa,
    abscissa_of,
    driven_side,
    lattice_size,
    load_kind,
    load_names,
    structures,
)
from reports.figures.loading_path.curves import over_cases
from reports.page import RobustTable
from reports.study import StudyResults, display_name, from_dataset
from sim.core import Floats


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
        *grouped("Checks along the path", checks.path_facts(study.problem, study.response)),
        *grouped("Contact", contact_comparison.contact_facts(study)),
        *grouped("Load steps", checks.variant_facts(study.verification)),
        *grouped("Imperfect copies", [*worst_copy_fact(study), *robustness_facts(study)]),
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
        note = f"the set of values that was run, of Figure {paper.figure}"
        yield Fact("variant", "Values", np.nan, "1", paper.variant, note=note)
    initial = from_dataset(study.design, lattice.spacing, "vertices_initial")
    yield Fact("units", "Units", lattice.n_units, "1", lattice_size(lattice))
    yield number("spacing", "Spacing", lattice.spacing, "mm")
    if isinstance(lattice, Quads):
        yield checks.bias_fact(initial)
    yield number("ligament_length", "Ligament length", lattice.ligament_length, "mm")
    removed = initial.n_units - int(from_dataset(study.design, lattice.spacing).present.sum())
    if removed:
        yield number("removed_units", "Units removed", removed)
    yield number("cloak_units", "Units redesigned", int((response["region"] == 1).sum()))
    yield number("interest_units", "Units of interest", int(response["roi"].sum()))
    yield from _radii(problem)
    if path.static:
        yield _load_fact(path)
        if path.displaces:
            yield from strain_facts(problem, path)
        count = problem.horizon.steps or problem.horizon.samples
        yield number("load_steps", "Loads in the loss", count, note="equally spaced")
    else:
        yield from _drive_facts(problem)
        yield number("horizon", "Loss taken over", problem.horizon_time, "s")


def _radii(problem: Problem) -> Iterator[Fact]:
    """Tells how far round regions reach."""
    spacing = problem.lattice.spacing
    for key, label, region in (
        ("interest_radius", "Radius of the region of interest", problem.objective.region),
        ("void_radius", "Radius of the void", problem.void),
        ("cloak_radius", "Radius of the cloak", problem.cloak),
    ):
        bounds = region.bounds if isinstance(region, Region) else None
        if bounds is not None:
            yield number(key, label, bounds[2], "mm", note=f"{bounds[2] / spacing:.4g} spacings")
    width = _cloak_width(problem)
    if width is not None:
        yield number(
            "cloak_width", "Width of the cloak", width, "mm", note=f"{width / spacing:.4g} spacings"
        )


def _cloak_width(problem: Problem) -> float | None:
    """Finds the width of a cloak around something round, mm."""
    if problem.cloak.around is not None:
        return problem.cloak.around.distance
    cloak = problem.cloak.bounds
    if cloak is None:
        return None
    within = (problem.void, problem.objective.region)
    rounds = [region.bounds for region in within if isinstance(region, Region)]
    inner = max([cloak[1], *(bounds[2] for bounds in rounds if bounds is not None)])
    return cloak[2] - inner if inner > 0 else None


def _load_fact(path: Abscissa) -> Fact:
    note = "of the driven units, along the drive" if path.displaces else "on the driven units"
    if path.strain is not None:
        note += f"; the paper labels it ε = {100 * path.strain:g} %"
    return number("amplitude", path.name, float(path.values[-1]), path.unit, note=note)


def strain_facts(problem: Problem, path: Abscissa) -> Iterator[Fact]:
    """Yields the strain along the line from the middle to the driven side, a row for each kind."""
    _, axis = driven_side(problem)
    span = float(np.ptp([site[1 + axis] for site in problem.lattice.sites()]))
    angles = np.degrees(getattr(problem.drive, "directions", ()) or (np.pi,))
    ends = ("columns", "rows")[axis]
    note = f"applied displacement over the {worded(span, 'mm', 4)} between the outermost {ends}"
    kinds = dict.fromkeys(load_kind(problem, float(angle)) for angle in angles)
    for place, kind in enumerate(kinds):
        key = "strain" if place == 0 else f"strain_{kind}"
        yield share(key, kind.capitalize(), float(path.values[-1]) / span, note=note)


def _drive_facts(problem: Problem) -> Iterator[Fact]:
    """Yields amplitude and frequency of a harmonic drive."""
    if isinstance(problem.drive, HarmonicDrive | RampHarmonicDrive):
        yield number("amplitude", "Amplitude A", problem.drive.amplitude, "mm")
        yield number("frequency", "Frequency f", problem.drive.frequency, "Hz")


def measure_facts(study: StudyResults, path: Abscissa) -> Iterator[Fact]:
    """Yields the measure of path or motion, and its reduction by the cloak."""
    measure = measures.measure_of(study.problem)
    values = over_cases(study.problem, measure.of(study.response))
    where = f"at {path.at(-1)}" if path.static else "root mean square over the time shown"
    whole = measures.overall(study.problem, values)
    for name in ("altered", "cloaked"):
        label = f"{measure.label}, {display_name(study.problem, name).lower()}"
        found, note = float(whole.sel(structure=name)), f"{where}{measure.formula}"
        yield number(f"{measure.key}_{name}", label, found, measure.unit, digits=3, note=note)
        yield from _each_load(
            study,
            f"{measure.key}_{name}",
            measure.label,
            measures.overall(study.problem, measure.of(study.response)),
            name,
            measure.unit,
        )
    altered, cloaked = (values.sel(structure=name) for name in ("altered", "cloaked"))
    label = f"{measure.label} reduced by"
    gain = 1.0 - float(whole.sel(structure="cloaked") / whole.sel(structure="altered"))
    yield share(f"{measure.key}_reduction", label, gain, note=where)
    if path.static:
        gains = (1.0 - cloaked / altered).isel(time=slice(altered.sizes["time"] // 2, None))
        key, least = f"{measure.key}_reduction_least", float(gains.min())
        note = "the least over the second half of the path"
        yield share(key, f"{label}, at least", least, note=note)
    key, most = f"{measure.key}_cloaked_most", float(cloaked.max())
    label = f"{measure.label}, cloaked, at most"
    note = "the largest on the whole path" if path.static else "the largest at any time"
    yield number(key, label, most, measure.unit, digits=3, note=note)


def _each_load(
    study: StudyResults, key: str, label: str, values: xr.DataArray, name: str, unit: str
) -> Iterator[Fact]:
    """Yields a row for each of several load cases, whose mean the row above is."""
    loads = load_names(study.problem, study.response)
    part = values.sel(structure=name)
    ends = part.isel(time=-1) if "time" in part.dims else part
    for case, load in enumerate(loads if len(loads) > 1 else ()):
        told = f"{label}, {display_name(study.problem, name).lower()}, {load}"
        yield number(
            f"{key}_case{case}", told, float(ends[case]), unit, digits=3, note="one load case"
        )


def loss_facts(study: StudyResults, path: Abscissa) -> Iterator[Fact]:
    """Yields the loss that was minimised, before and after."""
    unit = "N mm" if study.problem.objective.kind == "strain_energy" else "1"
    start, end = mean_losses(study)
    for key, name, value in (("start", "altered", start), ("end", "cloaked", end)):
        label = f"Loss, {display_name(study.problem, name).lower()}"
        yield number(f"loss_{key}", label, value, unit, digits=3)
        yield from _each_load(study, f"loss_{key}", "Loss", study.response["loss"], name, unit)
    yield share("loss_reduction", "Loss reduced by", 1.0 - end / start)
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
    places = np.interp(loads, part["time"].values, path.values)
    where = " and ".join(worded(float(place), path.unit, 3) for place in places)
    other = float(
        over_cases(study.problem, study.response["loss_other_branch"]).sel(structure="cloaked")
    )
    words, note = worded(loss, unit, 3), "at a limit point; the loss is that after it"
    if np.isfinite(other):
        words += f" or {worded(other, unit, 3)}"
        note = "where the path branches; the loss on either branch"
    turns = _turns(part["traced_load"].values)
    if len(turns):
        way = np.interp(turns, part["time"].values, path.values)
        to = " and ".join(worded(float(place), path.unit, 3) for place in way)
        note += f"; traced by arc length, the path that it leaves turns at {to}"
    ours = f"snaps at {where}: {words}"
    yield Fact("snaps", "Loss, cloaked", float(places[0]), path.unit, ours, note=note)


def _turns(loads: Floats) -> Floats:
    """Lists loads at which traced paths (n_cases, n_points) turn back or forward again."""
    paths = [each[np.isfinite(each)] for each in loads]
    return np.concatenate(
        [each[1:-1][np.diff(np.sign(np.diff(each))) != 0.0] for each in paths] or [np.zeros(0)]
    )


def contraction_facts(study: StudyResults, path: Abscissa) -> Iterator[Fact]:
    """Yields change of the vertical distance between top and bottom rows."""
    if not path.static:
        return
    nearer = over_cases(study.problem, measures.contraction(study.problem, study.response)).isel(
        time=-1
    )
    count = len(middle_units(study.problem, "top"))
    note = f"how much nearer top and bottom rows come, mean of the middle {count} units"
    for name in structures(study.response):
        label = f"Contraction, {display_name(study.problem, name).lower()}"
        value = float(nearer.sel(structure=name))
        yield number(f"contraction_{name}", label, value, "mm", digits=3, note=note)
    if "intact" in structures(study.response):
        intact = float(nearer.sel(structure="intact"))
        for name in ("altered", "cloaked"):
            off = float(nearer.sel(structure=name)) / intact - 1.0
            label = f"Contraction, {display_name(study.problem, name).lower()}, off the intact by"
            yield share(f"contraction_error_{name}", label, off)


def reaction_facts(study: StudyResults, path: Abscissa) -> Iterator[Fact]:
    """Yields force of the drive at the end of the path, or how far its load goes."""
    if not path.static:
        return
    if not path.displaces:
        yield from _displacement_facts(study, path)
        return
    every = measures.reaction(study.response)
    force = over_cases(study.problem, every).isel(time=-1)
    note = f"on the driven units, along the drive, at {path.at(-1)}"
    for name in structures(study.response):
        label = f"Reaction, {display_name(study.problem, name).lower()}"
        value = float(force.sel(structure=name))
        yield number(f"reaction_{name}", label, value, "N", digits=3, note=note)
        yield from _each_load(study, f"reaction_{name}", "Reaction", every, name, "N")
    if "intact" in structures(study.response):
        note = "root mean square along the path, over the intact lattice's at its end"
        off = over_cases(study.problem, measures.reaction_error(every))
        for name in ("altered", "cloaked"):
            label = f"Reaction, {display_name(study.problem, name).lower()}, off the intact by"
            yield share(f"reaction_error_{name}", label, float(off.sel(structure=name)), note=note)


def _displacement_facts(study: StudyResults, path: Abscissa) -> Iterator[Fact]:
    moved = over_cases(study.problem, measures.driven_displacement(study.response)).isel(time=-1)
    note = f"of the driven units, mean, at {path.at(-1)}"
    for name in structures(study.response):
        label = f"Displacement, {display_name(study.problem, name).lower()}"
        value = float(moved.sel(structure=name))
        yield number(f"displacement_{name}", label, value, "mm", digits=3, note=note)


def _spreads_of_copies(study: StudyResults) -> Sequence[monte_carlo.Spread]:
    """Spreads the measure over the imperfect copies, if there are any."""
    copies = study.scatter
    if copies is None:
        return ()
    measure = measures.measure_of(study.problem)
    values = monte_carlo.copy_curves(study.problem, measure, study.response, copies)
    return monte_carlo.spreads(measures.overall(study.problem, values), copies)


def robustness_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields spread of the measure over the imperfect copies."""
    measure = measures.measure_of(study.problem)
    for spread in _spreads_of_copies(study):
        key = re.sub(r"\W+", "_", spread.noise).strip("_")
        note = (
            f"5 % to 95 %: {spread.low:.3g} to {spread.high:.3g}; {spread.count} copies, "
            f"{spread.failed} failed, {spread.clashing} drawn again in part as units overlapped"
        )
        label = f"{measure.label}, median, {_in_words(spread.noise)}"
        yield number(f"copies_{key}", label, spread.middle, measure.unit, digits=3, note=note)


def robust_table(study: StudyResults) -> RobustTable | None:
    """Lists the measure of the cloak as designed, built, and of copies."""
    spreads = _spreads_of_copies(study)
    if not spreads:
        return None
    measure = measures.measure_of(study.problem)
    rows = []
    for name, each in (("as designed", study), ("as built", study.as_built)):
        if each is not None:
            curves = over_cases(each.problem, measure.of(each.response))
            whole = measures.overall(each.problem, curves)
            nominal = worded(float(whole.sel(structure="cloaked")), measure.unit, 3)
            rows.append((name, nominal, ABSENT))
    for spread in spreads:
        failed = f", {spread.failed} failed" if spread.failed else ""
        name = f"{_in_words(spread.noise)} ({spread.count} copies{failed})"
        middle, high = (worded(x, measure.unit, 3) for x in (spread.middle, spread.high))
        rows.append((name, middle, high))
    return RobustTable(measure.label, rows)


def worst_copy_fact(study: StudyResults) -> Iterator[Fact]:
    """Yields the value that 95 % of the copies keep to, with all imperfections at once.

    Where these were not tried together, under the most harmful one.
    """
    measure = measures.measure_of(study.problem)
    found = [each for each in _spreads_of_copies(study) if np.isfinite(each.high)]
    if found:
        worst = max(found, key=lambda each: (each.noise.startswith("together"), each.high))
        label = f"{measure.label}, cloaked, in 95 % of copies at most"
        note = _in_words(worst.noise)
        key = f"{measure.key}_cloaked_copies"
        yield number(key, label, worst.high, measure.unit, digits=3, note=note)


def _in_words(noise: str) -> str:
    kind, _, size = noise.partition(" ")
    if kind == "together":
        shift, _, scatter = size.partition(", ")
        return f"vertices off by up to ±{shift} and stiffnesses with {scatter} standard deviation"
    if kind == "geometry":
        return f"vertices off by up to ±{size} of s"
    return f"stiffnesses with {size} standard deviation"
