"""Computes the numbers that the paper quotes on shielding dynamic excitations.

Paper: Bordiga et al., "Nonlinear mechanical metamaterial cloaks", section "Shielding dynamic
excitations" and the caption of its Figure 2.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import xarray as xr

from pipeline.comparison import compute_reduction
from reports.facts import (
    ABSENT,
    MEASURED,
    Fact,
    checks,
    constants_facts,
    foil,
    grouped,
    measures,
    number,
    percent,
    recording_facts,
    share,
    worded,
)
from reports.figures.shielding.sweep_map import frequency_map
from reports.study import (
    CLOAK,
    RecordedMotion,
    ReportScene,
    StudyResults,
    cycles,
    from_dataset,
    middle_of_top_edge,
)
from sim.core import Floats

MONITORED = 45.0
"""Direction in degrees of the load at which the paper shows the motion of one unit."""

PAPER_REDUCTION = 0.7
"""The paper's mean reduction of |U|, "approximately 70 %"."""


def shielding_facts(study: StudyResults) -> list[Fact]:
    """Returns all facts of Figure 2, under headings."""
    scene, design, response, sweep = (
        study.scene,
        study.design,
        study.response,
        frequency_map(study.sweep),
    )
    return [
        *grouped("Scene", scene_facts(scene, design)),
        *grouped("Shielding", loss_facts(scene, response)),
        *grouped("Optimisation", history_facts(design)),
        *grouped("Shape", shape_facts(scene, design)),
        *grouped("Motion of the middle unit of the top edge", motion_facts(scene, response)),
        *grouped("Measured motion of the same unit", recorded_facts(study)),
        *recording_facts.recorded_facts(study.recordings),
        *grouped("Robustness", map_facts(sweep)),
        *grouped(
            "With the constants’ measured spread",
            constants_facts(study.problem, study.constants, mean_losses(scene, response)),
        ),
        *grouped("Checks", check_facts(design, response)),
        *grouped("Checks", foil.strain_facts(study.problem, response)),
    ]


def scene_facts(scene: ReportScene, design: xr.Dataset) -> Iterator[Fact]:
    """Yields the problem as it was run."""
    initial = from_dataset(design, scene.spacing, "vertices_initial")
    size = f"{scene.columns} × {scene.rows}"
    yield Fact("units", "Units", initial.n_units, "1", size, "15 × 15")
    yield number("spacing", "Spacing", scene.spacing, "mm", paper="15 mm")
    yield replace(checks.bias_fact(initial), paper="20°")
    yield number("amplitude", "Amplitude A", scene.amplitude, "mm", paper="4.5 mm")
    yield number("frequency", "Frequency f", scene.frequency, "Hz", paper="2 Hz")
    yield number("period", "Period T", 1e3 * scene.period, "ms")
    angles = ", ".join(f"{angle:g}" for angle in scene.directions) + "°"
    count = len(scene.directions)
    yield Fact("directions", "Loading angles α", count, "1", angles, "0, 45, 90, 135°")
    radius = scene.radii[-1]
    words = f"{worded(radius, 'mm', 4)} = {radius / scene.spacing:g} spacings"
    reach = measures.site_radius(initial, scene.middle, CLOAK) / scene.spacing
    note = f"4.5 is the authors' code, 4 their text; the farthest cloak unit lies at {reach:.3g}"
    yield Fact("radius", "Cloak radius", radius, "mm", words, "60 mm = 4 spacings", note)
    note = f"{scene.horizon * scene.frequency:g} drive cycles from rest"
    yield number("horizon", "Loss taken over", scene.horizon, "s", note=note)


def loss_facts(scene: ReportScene, response: xr.Dataset) -> Iterator[Fact]:
    """Yields reduction of |U| and the loss before and after."""
    everything = float(response["time"][-1])
    for suffix, label, until, paper in (
        ("", "Mean |U| reduced by", scene.horizon, "≈ 70 %"),
        ("_all", "Mean |U| reduced by, all cycles", everything, "—"),
    ):
        mean = scene.mean(measures.mean_magnitude(response, scene, until))
        note = f"mean over the region of interest, all load cases and {until:g} s"
        yield share(f"mean_reduction{suffix}", label, measures.reduction(mean), paper, note)
    note = f"time integral over {scene.horizon:g} s"
    start, end = mean_losses(scene, response)
    yield loss_fact("loss_start", "Loss J, altered", start, note=note)
    paper = f"≈ {paper_loss(start):.2g}"
    note += "; the paper's is inferred from its 70 %, (1 − 0.7)² of ours at the start"
    yield loss_fact("loss_end", "Loss J, cloaked", end, paper, note)
    for key, name in (("start", "altered"), ("end", "cloaked")):
        value = mean_loss(scene, response, "loss_samples", name)
        label = f"Loss J, {name}, mean of samples"
        note = "the authors' mean over the saved samples of the same time"
        yield loss_fact(f"loss_samples_{key}", label, value, note=note)


def loss_fact(key: str, label: str, value: float, paper: str = ABSENT, note: str = "") -> Fact:
    """Returns fact of a loss, to four decimals."""
    return Fact(key, label, value, "1", f"{value:.4f}", paper, note)


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


def history_facts(design: xr.Dataset) -> Iterator[Fact]:
    """Yields evaluations and best feasible loss of every method."""
    for method in design["method"].values:
        history = design.sel({"method": method})
        loss = history["loss"].values
        count, best = int(np.isfinite(loss).sum()), float(history["best_loss"])
        name, ours = str(method).upper(), method == design.attrs.get("shipped_method")
        soon = measures.first_within(loss[:count], best, 0.9)
        note = (
            f"best feasible after {int(history['best_evaluation'])}, 90 % of the way after {soon}"
        )
        yield number(
            f"evaluations_{method}", f"Evaluations, {name}", count, paper="≈ 150", note=note
        )
        note = "shipped" if ours else "not shipped"
        yield loss_fact(f"best_{method}", f"Best feasible J, {name}", best, note=note)
        residual = float(history["kkt_residual"])
        yield number(f"kkt_{method}", f"KKT residual, {name}", residual, digits=2)


def shape_facts(scene: ReportScene, design: xr.Dataset) -> Iterator[Fact]:
    """Yields four-fold symmetry and porosity of the design."""
    structure = from_dataset(design, scene.spacing)
    initial = from_dataset(design, scene.spacing, "vertices_initial")
    distances = measures.asymmetry(structure, scene.middle)
    rms = float(np.sqrt(np.mean(distances**2)))
    note = (
        "RMS distance of the cloak's vertices from those of the design turned by 90°; "
        f"largest {worded(float(distances.max()), 'mm', 2)}; "
        + ("imposed here, not in the paper" if scene.symmetry == "C4" else "not imposed")
    )
    label, told = "Departure from four-fold symmetry", "symmetric"
    yield number("asymmetry", label, rms, "mm", digits=2, paper=told, note=note)
    inner, outer = (scene.radii[-1] + side * 0.5 * scene.spacing for side in (-1.0, 1.0))
    for key, where, low, high, paper in (
        ("centre", "centre of the cloak", 0.0, inner, "high"),
        ("rim", "boundary of the cloak", inner, outer, "low"),
    ):
        before, after = (
            measures.porosity(each, scene.middle, low, high) for each in (initial, structure)
        )
        note = f"open share from {low:g} to {high:g} mm off the source; {percent(before)} initially"
        yield share(f"porosity_{key}", f"Porosity, {where}", after, paper, note)


def motion_facts(scene: ReportScene, response: xr.Dataset) -> Iterator[Fact]:
    """Yields peak-to-peak u_y of the unit in the middle of the top edge."""
    series = monitored(scene, response)
    angle = float(series["direction"])
    yield number("monitored_angle", "Loading angle α of it", angle, "deg")
    yield number("monitored_cycles", "Cycles shown", cycles(scene, response), digits=3)
    for suffix, count, paper in (
        ("", cycles(scene, response), ("5.2 mm", "1.9 mm", "63 %")),
        ("_horizon", scene.horizon * scene.frequency, ("—", "—", "—")),
    ):
        span = measures.peak_to_peak(series, count * scene.period)
        window = f"cycles 1 to {count:.3g}"
        note = f"α = {angle:g}°, from rest, transient included"
        for name, quoted in zip(("altered", "cloaked"), paper, strict=False):
            label = f"u_y peak-to-peak, {name}, {window}"
            value = float(span.sel(structure=name))
            key = f"peak_to_peak_{name}{suffix}"
            yield number(key, label, value, "mm", digits=3, paper=quoted, note=note)
        label = f"u_y peak-to-peak reduced by, {window}"
        key = f"peak_to_peak_reduction{suffix}"
        yield share(key, label, measures.reduction(span), paper[2], note)


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
    for each in monitored_recordings(study):
        found = each.data["peak_to_peak"].isel(unit=unit).sel(dof="uy")
        sides = spans[each.structure] = [
            found.sel(source=source).values for source in ("measured", "simulated")
        ]
        words = recording_facts.intervals(sides[0][1:], sides[1][1:], " mm")
        note = f"{each.source}; {words}"
        label = f"u_y peak-to-peak, {each.structure}, measured"
        key = f"{MEASURED}peak_to_peak_{each.structure}"
        yield number(key, label, float(sides[0][0]), "mm", digits=3, note=note)
    if {"altered", "cloaked"} <= spans.keys():
        label = "u_y peak-to-peak reduced by, measured"
        gain, predicted = map(compute_reduction, spans["altered"], spans["cloaked"])
        note = recording_facts.intervals(100 * gain[1:], 100 * predicted[1:], " %")
        yield share(f"{MEASURED}peak_to_peak_reduction", label, float(gain[0]), note=note)


def map_facts(sweep: xr.Dataset) -> Iterator[Fact]:
    """Extremes of the robustness map."""
    loss, ratio = sweep["loss"], sweep["loss"] / sweep["loss_altered"]
    worst = loss.where(loss == loss.max(), drop=True)
    angle, rate = float(worst["direction"][0]), float(worst["frequency"][0])
    note = f"at α = {angle:g}°, f = {rate:g} Hz"
    yield loss_fact("map_max", "Largest J over the map", float(loss.max()), "< 0.35", note)
    yield loss_fact("map_min", "Smallest J over the map", float(loss.min()))
    note = "1 − √(J / J of the altered structure) at the worst point"
    yield share(
        "map_reduction", "RMS |U| reduced at least by", 1 - float(np.sqrt(ratio.max())), note=note
    )
    for key, label, axis, unit, of, paper in (
        ("map_angles", "Angles α", "direction", "°", "deg", "0–180°"),
        ("map_frequencies", "Frequencies f", "frequency", " Hz", "Hz", "2–16 Hz"),
    ):
        values = sweep[axis].values
        words = f"{values.min():g}–{values.max():g}{unit}"
        yield Fact(key, label, len(values), "1", words, paper, f"{len(values)} values")
        for end, edge in (("least", values.min()), ("most", values.max())):
            yield number(f"{key}_{end}", f"{label}, {end}", float(edge), of)
    failed = int((sweep["status"] != "ok").sum())
    yield number("map_failed", "Points without a result", failed, note=f"of {loss.size}")


def check_facts(design: xr.Dataset, response: xr.Dataset) -> Iterator[Fact]:
    """Yields margins of the constraints, geometry and estimated errors of the shipped design."""
    yield from checks.design_facts(design)
    cloaked = response.sel(structure="cloaked")
    motion = "cloaked, all load cases and times, by geometry"
    moving = float(cloaked["min_gap"].min())
    yield number("gap_motion", "Smallest gap in motion", moving, "mm", digits=3, note=motion)
    crossed = int(cloaked["overlaps"].sum())
    yield number("overlaps_motion", "Overlaps in motion", crossed, note=motion)
    void = float(np.degrees(cloaked["min_void_angle"].min()))
    label, note = "Smallest void angle in motion", "cloaked, all load cases and times"
    yield number("void_angle_motion", label, void, "deg", digits=3, note=note)
    note = "relative, by step halving; the largest of all load cases"
    yield from checks.error_facts(response, note)
