"""Computes the numbers that the paper quotes on shielding dynamic excitations.

Paper: Bordiga et al., "Nonlinear mechanical metamaterial cloaks", section "Shielding dynamic
excitations" and the caption of its Figure 2.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import xarray as xr

from pipeline.comparison import compute_reduction
from pipeline.problem import Problem
from reports.facts import (
    MEASURED,
    Fact,
    checks,
    constants_facts,
    copies,
    facts_of,
    foil,
    grouped,
    loss_formula,
    measures,
    percent,
    recording_facts,
    rounded,
    worded,
)
from reports.figures.shielding.sweep_map import frequency_map
from reports.study import (
    CLOAK,
    RecordedMotion,
    ReportScene,
    StudyResults,
    cycles,
    evaluation_count,
    from_dataset,
    middle_of_top_edge,
    takes,
)
from sim.core import Floats

MONITORED = 45.0
"""Direction in degrees of the load at which the paper shows the motion of one unit."""

PAPER_REDUCTION = 0.7
"""The paper's mean reduction of |U|, "approximately 70 %"."""
_told = facts_of(__file__)


def shielding_facts(study: StudyResults) -> list[Fact]:
    """Returns all facts of Figure 2, under headings."""
    scene, design, response = study.scene, study.design, study.response
    return [
        *grouped("Scene", scene_facts(study)),
        *grouped("Shielding", loss_facts(study)),
        *grouped("Optimisation", history_facts(study.problem, design)),
        *grouped("Shape", shape_facts(study)),
        *grouped("Motion of the middle unit of the top edge", motion_facts(scene, response)),
        *grouped("Measured motion of the same unit", recorded_facts(study)),
        *recording_facts.recorded_facts(study.recordings),
        *grouped("Robustness", map_facts(frequency_map(study.sweep))),
        *grouped("Imperfect copies", copies.loss_facts(study)),
        *grouped(
            "With the constants’ measured spread",
            constants_facts(study.problem, study.constants, mean_losses(scene, response)),
        ),
        *grouped("Checks", check_facts(design, response)),
        *grouped("Checks", foil.strain_facts(study.problem, design, response)),
    ]


def scene_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields the problem as it was run."""
    scene, design = study.scene, study.design
    initial = from_dataset(design, scene.spacing, "vertices_initial")
    yield _told("units", initial.n_units, f"{scene.columns} × {scene.rows}")
    yield _told("spacing", scene.spacing)
    yield replace(checks.bias_fact(initial), paper="20°")
    yield _told("amplitude", scene.amplitude)
    yield _told("frequency", scene.frequency)
    yield _told("period", 1e3 * scene.period)
    angles = ", ".join(f"{angle:g}" for angle in scene.directions) + "°"
    yield _told("directions", len(scene.directions), angles)
    radius = scene.radii[-1]
    words = f"{worded(radius, 'mm', 4)} = {radius / scene.spacing:g} spacings"
    reach = measures.site_radius(initial, scene.middle, CLOAK) / scene.spacing
    of_paper = "4.5 is the authors' code, 4 their text; " if _is_papers(study) else ""
    yield _told("radius", radius, words, reach=reach, of_paper=of_paper)
    yield _told("horizon", scene.horizon, cycles=scene.horizon * scene.frequency)


def loss_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields reduction of |U| and the loss before and after."""
    scene, response = study.scene, study.response
    for suffix, until in (("", scene.horizon), ("_all", float(response["time"][-1]))):
        mean = scene.mean(measures.mean_magnitude(response, scene, until))
        yield _told(f"mean_reduction{suffix}", measures.reduction(mean), until=until)
    start, end = mean_losses(scene, response)
    loss, of = response["loss"], {"formula": loss_formula(study.problem), "until": scene.horizon}
    yield _loss("loss_start", start, loss, **of)
    inferred = "; the paper's is inferred from its 70 %, (1 − 0.7)² of ours at the start"
    of["of_paper"] = inferred if _is_papers(study) else ""
    yield _loss("loss_end", end, loss, **of, quoted=paper_loss(start))
    for key, name in (("start", "altered"), ("end", "cloaked")):
        value = mean_loss(scene, response, "loss_samples", name)
        yield _loss("loss_samples_{key}", value, loss, key=key, name=name)


def _is_papers(study: StudyResults) -> bool:
    """Tests if a study follows a publication, with which its facts compare it."""
    return study.problem.report.paper is not None


def _loss(key: str, value: float, of: xr.DataArray, /, **words: object) -> Fact:
    """Tells a loss in the unit of those that it is of."""
    unit = str(of.attrs.get("units", "1"))
    return _told(key, value, worded(value, unit, 3), unit=unit, **words)


def mean_loss(scene: ReportScene, response: xr.Dataset, variable: str, structure: str) -> float:
    """Returns mean loss of a structure over its load cases."""
    return float(scene.mean(response[variable].sel(structure=structure)))


def mean_losses(scene: ReportScene, response: xr.Dataset) -> tuple[float, float]:
    """Returns mean losses of the altered structure and of the design over their load cases."""
    start, end = (mean_loss(scene, response, "loss", name) for name in ("altered", "cloaked"))
    return start, end


def paper_loss(start: float) -> float:
    """Loss to which the paper's reduction of |U| amounts, from a loss `start`."""
    return start * (1.0 - PAPER_REDUCTION) ** 2


def history_facts(problem: Problem, design: xr.Dataset) -> Iterator[Fact]:
    """Yields evaluations and best feasible loss of every method."""
    for method in design["method"].values:
        history, of = design.sel({"method": method}), {"method": method, "name": method.upper()}
        count, best = evaluation_count(history), float(history["best_loss"])
        reached = checks.reached(problem, history)
        yield _told("evaluations_{method}", count, reached=reached, **of)
        note = checks.shipping(problem, design, str(method))
        yield _loss("best_{method}", best, design["best_loss"], note=note, **of)
        yield _told("kkt_{method}", float(history["kkt_residual"]), **of)


def shape_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields four-fold symmetry and porosity of the design."""
    scene, design = study.scene, study.design
    structure = from_dataset(design, scene.spacing)
    initial = from_dataset(design, scene.spacing, "vertices_initial")
    distances = measures.asymmetry(structure, scene.middle)
    largest = worded(float(distances.max()), "mm", 2)
    imposed = "imposed" if scene.symmetry == "C4" else "not imposed"
    if imposed == "imposed" and _is_papers(study):
        imposed = "imposed here, not in the paper"
    rms = float(np.sqrt(np.mean(distances**2)))
    yield _told("asymmetry", rms, largest=largest, imposed=imposed)
    inner, outer = (scene.radii[-1] + side * 0.5 * scene.spacing for side in (-1.0, 1.0))
    for key, low, high in (("centre", 0.0, inner), ("rim", inner, outer)):
        before, after = (
            measures.porosity(each, scene.middle, low, high) for each in (initial, structure)
        )
        yield _told(f"porosity_{key}", after, low=low, high=high, before=percent(before))


def motion_facts(scene: ReportScene, response: xr.Dataset) -> Iterator[Fact]:
    """Yields peak-to-peak u_y of the unit in the middle of the top edge."""
    series = monitored(scene, response)
    angle, shown = float(series["direction"]), cycles(scene, response)
    yield _told("monitored_angle", angle)
    yield _told("monitored_cycles", shown)
    for suffix, count in (("", shown), ("_horizon", scene.horizon * scene.frequency)):
        span = measures.peak_to_peak(series, count * scene.period)
        words = {"angle": angle, "count": count}
        for name in ("altered", "cloaked"):
            yield _told(f"peak_to_peak_{name}{suffix}", float(span.sel(structure=name)), **words)
        yield _told(f"peak_to_peak_reduction{suffix}", measures.reduction(span), **words)


def monitored(scene: ReportScene, response: xr.Dataset) -> xr.DataArray:
    """Returns displacement u_y (structure, time) in mm of the middle unit of the top edge."""
    unit = middle_of_top_edge(from_dataset(response.isel(structure=0), scene.spacing))
    case = measures.nearest_case(response, MONITORED)
    return response["displacement"].isel(case=case, unit=unit).sel(dof="uy")


def monitored_recordings(study: StudyResults) -> list[RecordedMotion]:
    """Returns the recordings under the load at which the motion of one unit is shown."""
    case = measures.nearest_case(study.response, MONITORED)
    return [each for each in study.recordings if each.case == case]


def recorded_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields peak-to-peak u_y of the same unit as it was measured."""
    unit = middle_of_top_edge(from_dataset(study.response.isel(structure=0), study.scene.spacing))
    spans: dict[str, list[Floats]] = {}
    recorded = monitored_recordings(study)
    for each in recorded:
        found = each.data["peak_to_peak"].isel(unit=unit).sel(dof="uy")
        sides = spans[each.name] = [
            found.sel(source=source).values for source in ("measured", "simulated")
        ]
        words = recording_facts.intervals(sides[0][1:], sides[1][1:], each.level, "mm")
        of = {"structure": each.structure, "source": each.source} | _take(each.take)
        span = float(sides[0][0])
        shown = rounded(span, sides[0][1:], "mm")
        yield _told("{start}peak_to_peak_{structure}{take}", span, shown, words=words, **of)
    for take, some in takes(recorded):
        named = {each.structure: spans[each.name] for each in some}
        if {"altered", "cloaked"} <= named.keys():
            gain, predicted = map(compute_reduction, named["altered"], named["cloaked"])
            ends = 100 * gain[1:], 100 * predicted[1:]
            note = recording_facts.intervals(*ends, some[0].level, "%")
            of = {"note": note} | _take(take)
            shown = rounded(100 * float(gain[0]), ends[0], "%")
            yield _told("{start}peak_to_peak_reduction{take}", float(gain[0]), shown, **of)


def _take(number: int) -> dict[str, str]:
    """Ends the key and the label of a fact of one take of several."""
    told = f", take {number}" if number else ""
    return {"start": MEASURED, "take": f"_take{number}" if number > 1 else "", "told": told}


def map_facts(sweep: xr.Dataset) -> Iterator[Fact]:
    """Extremes of the robustness map, as far as it has results."""
    failed = sweep["status"] != "ok"
    yield _told("map_failed", int(failed.sum()), count=failed.size)
    if failed.all():
        return
    loss, ratio = sweep["loss"], sweep["loss"] / sweep["loss_altered"]
    worst = loss.where(loss == loss.max(), drop=True)
    angle, rate = float(worst["direction"][0]), float(worst["frequency"][0])
    yield _loss("map_max", float(loss.max()), loss, angle=angle, rate=rate)
    yield _loss("map_min", float(loss.min()), loss)
    yield _told("map_reduction", 1 - float(np.sqrt(ratio.max())))
    for key, axis, unit in (
        ("map_angles", "direction", "°"),
        ("map_frequencies", "frequency", " Hz"),
    ):
        values = sweep[axis].values
        words = f"{values.min():g}–{values.max():g}{unit}"
        yield _told(key, len(values), words, count=len(values))
        for end, edge in (("least", values.min()), ("most", values.max())):
            yield _told(f"{key}_{{end}}", float(edge), end=end)


def check_facts(design: xr.Dataset, response: xr.Dataset) -> Iterator[Fact]:
    """Yields margins of the constraints, geometry and estimated errors of the shipped design."""
    yield from checks.design_facts(design)
    cloaked = response.sel(structure="cloaked")
    yield _told("gap_motion", float(cloaked["min_gap"].min()))
    yield _told("overlaps_motion", int(cloaked["overlaps"].sum()))
    yield _told("void_angle_motion", float(np.degrees(cloaked["min_void_angle"].min())))
    note = "relative, by step halving; the largest of all load cases"
    yield from checks.error_facts(response, note)
