"""Describes the numbers of a report on waves, each computed from the datasets."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from pipeline.problem.sections import RampHarmonicDrive
from reports.facts import Fact, checks, grouped, number, share, within, worded
from reports.figures.loading_path import (
    abscissa_of,
    loss_facts,
    measures,
    over_cases,
    overlapping,
    scene_facts,
    structures,
)
from reports.figures.wave.closed_voids import edge_contacts
from reports.figures.wave.monitored_places import places, relative_error
from reports.study import StudyResults, display_name


def wave_facts(study: StudyResults) -> list[Fact]:
    """Returns all facts, under headings."""
    path = abscissa_of(study.problem, study.response)
    return [
        *grouped("Scene", (*scene_facts(study, path), *drive_facts(study))),
        *grouped("Result", error_facts(study)),
        *grouped("Loss", (*loss_facts(study, path), *sum_facts(study))),
        *grouped("Marked places", place_facts(study)),
        *grouped("Contact on the edges", edge_facts(study)),
        *grouped("Time steps", step_facts(study.verification)),
        *grouped("Optimisation", checks.history_facts(study.problem, study.design)),
        *grouped("Checks of the design", checks.design_facts(study.design)),
        *grouped("Checks over time", checks.path_facts(study.problem, study.response)),
    ]


def drive_facts(study: StudyResults) -> Iterator[Fact]:
    """Tells how the drive is switched on."""
    drive = study.problem.drive
    if isinstance(drive, RampHarmonicDrive):
        note = "A (1 + tanh((t − delay)/rise))/2 sin(2πf (t − delay))"
        yield number("delay", "Delay of the drive", 1e3 * drive.delay, "ms", note=note)
        yield number("rise", "Rise time of the drive", 1e3 * drive.rise_time, "ms")


def error_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields relative error over the whole history, and the largest mimicking error."""
    error = over_cases(study.problem, relative_error(study.problem, study.response))
    most = over_cases(study.problem, measures.measure_of(study.problem).of(study.response))
    for name in ("altered", "cloaked"):
        words = display_name(study.problem, name).lower()
        note = "L2 over the surroundings and the whole history, relative to the intact"
        value = float(error.sel(structure=name))
        yield number(f"error_{name}", f"Relative error, {words}", value, digits=3, note=note)
        peak = float(most.sel(structure=name).max())
        note = "distance to the intact over its largest size in time"
        yield number(f"peak_{name}", f"Largest mimicking error, {words}", peak, digits=3, note=note)
    gain = 1.0 - float(error.sel(structure="cloaked")) / float(error.sel(structure="altered"))
    yield share("error_reduction", "Relative error reduced by", gain)


def sum_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields the loss as the authors sum it."""
    count = study.problem.horizon.samples
    loss = over_cases(study.problem, study.response["loss_samples"])
    for name in ("altered", "cloaked"):
        label = f"Loss as the authors sum it, {display_name(study.problem, name).lower()}"
        note = f"over {count} samples: √{count} times the root of their mean square"
        value = float(np.sqrt(count)) * float(loss.sel(structure=name))
        yield number(f"loss_sum_{name}", label, value, digits=3, note=note)


def place_facts(study: StudyResults) -> Iterator[Fact]:
    """Tells how far u_y is from that of the intact structure at the marked places."""
    rise = over_cases(study.problem, study.response["displacement"].sel(dof="uy"))
    for k, place in enumerate(places(study.problem, study.response)):
        curves = rise.isel(unit=place.unit)
        intact = curves.sel(structure="intact")
        for name in ("altered", "cloaked"):
            apart = ((curves.sel(structure=name) - intact) ** 2).mean("time") ** 0.5
            label = f"u_y, {place.name}, {display_name(study.problem, name).lower()}"
            note = f"RMS distance to the intact, whose largest is {_largest(intact)}"
            key = f"place_{k + 1}_{name}"
            yield number(key, label, float(apart), "mm", digits=3, note=note)


def _largest(series: xr.DataArray) -> str:
    return worded(float(np.abs(series).max()), "mm", 3)


def edge_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields closed voids along the top and bottom edges."""
    counts = over_cases(study.problem, edge_contacts(study.problem, study.response))
    for name in structures(study.response):
        words = display_name(study.problem, name).lower()
        of_one = counts.sel(structure=name)
        time = 100.0 * float((of_one > 0).mean())
        note = f"along the top and bottom edges; at least one in {time:.1f} % of the time"
        label = f"Closed voids at once, {words}, most"
        yield number(f"edge_contacts_{name}", label, int(of_one.max()), note=note)


def step_facts(verification: xr.Dataset | None) -> Iterator[Fact]:
    """Loss and error with shorter steps, and with contact on the distance of units."""
    if verification is None:
        return
    for name in (str(name) for name in verification["check"].values):
        found = verification.sel(check=name)
        key, status = name.replace(" ", "_"), str(found["status"].item())
        for structure in ("altered", "cloaked"):
            part = found.sel(structure=structure)
            label = f"Loss, {structure}, {name}"
            if status != "ok":
                yield Fact(f"check_{key}_{structure}", label, np.nan, "1", "—", note=status)
                continue
            step = worded(1e6 * float(part["time_step"]), "µs", 4)
            note = (
                f"relative error {float(part['error']):.3g}; steps of {step}; "
                f"{overlapping(int(part['overlaps']))}"
            )
            if (apart := float(part["departure"])) > 0.0:
                note += f"; units {within(apart, 'mm', 2)} from the run at most"
            value = float(part["loss"])
            yield number(f"check_{key}_{structure}", label, value, digits=4, note=note)
