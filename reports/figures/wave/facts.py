"""Describes the numbers of a report on waves, each computed from the datasets."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from pipeline.problem.sections import RampHarmonicDrive
from reports.facts import Fact, checks, copies, facts_of, grouped, within, worded
from reports.figures.loading_path import (
    abscissa_of,
    loss_facts,
    measures,
    over_cases,
    overlapping,
    scene_facts,
    structures,
)
from reports.figures.wave.contacts import contact_measure, void_measure
from reports.figures.wave.edge_contacts import edge_contacts
from reports.figures.wave.monitored_places import places, relative_error
from reports.study import StudyResults, display_name

_told = facts_of(__file__)


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
        *grouped("Imperfect copies", copies.loss_facts(study)),
        *grouped("Checks of the design", checks.design_facts(study.design)),
        *grouped(
            "Checks over time", checks.path_facts(study.problem, study.design, study.response)
        ),
    ]


def drive_facts(study: StudyResults) -> Iterator[Fact]:
    """Tells how the drive is switched on."""
    drive = study.problem.drive
    if isinstance(drive, RampHarmonicDrive):
        yield _told("delay", 1e3 * drive.delay)
        yield _told("rise", 1e3 * drive.rise_time)


def error_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields relative error over the whole history, and the largest mimicking error."""
    error = over_cases(study.problem, relative_error(study.problem, study.response))
    most = measures.measure_of(study.problem).of(study.response)
    several = most.sizes["case"] > 1
    mean = "; weighted mean of the load cases" * several
    any_case = "; the largest of any load case" * several
    for name in ("altered", "cloaked"):
        of = {"name": name, "shown": display_name(study.problem, name).lower()}
        yield _told("error_{name}", float(error.sel(structure=name)), mean=mean, **of)
        peak = float(most.sel(structure=name).max())
        yield _told("peak_{name}", peak, any_case=any_case, **of)
    gain = 1.0 - float(error.sel(structure="cloaked")) / float(error.sel(structure="altered"))
    yield _told("error_reduction", gain)


def sum_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields the loss as the authors sum it."""
    count = study.problem.horizon.samples
    loss = over_cases(study.problem, study.response["loss_samples"])
    for name in ("altered", "cloaked"):
        shown = display_name(study.problem, name).lower()
        value = float(np.sqrt(count)) * float(loss.sel(structure=name))
        yield _told("loss_sum_{name}", value, name=name, shown=shown, count=count)


def place_facts(study: StudyResults) -> Iterator[Fact]:
    """Tells how far u_y is from that of the intact structure at the marked places."""
    rise = study.response["displacement"].sel(dof="uy")
    for k, place in enumerate(places(study.problem, study.response)):
        curves = rise.isel(unit=place.unit)
        intact = curves.sel(structure="intact")
        most = worded(float(np.abs(intact).max()), "mm", 3)
        for name in ("altered", "cloaked"):
            squares = ((curves.sel(structure=name) - intact) ** 2).mean("time")
            apart = over_cases(study.problem, squares**0.5)
            of = {"name": name, "shown": display_name(study.problem, name).lower()}
            yield _told("place_{k}_{name}", float(apart), k=k + 1, place=place, most=most, **of)


def edge_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields contacts along the top and bottom edges: by the law that is run, by the authors'."""
    problem = study.problem
    cutoff = float(np.degrees(problem.contact.cutoff_angle))
    for key, measure in (
        ("edge_contacts_{name}", contact_measure(problem)),
        ("edge_voids_{name}", void_measure(problem)),
    ):
        counts = edge_contacts(problem, study.response, measure).max("case")
        for name in structures(study.response):
            of_one = counts.sel(structure=name)
            of = {"name": name, "shown": display_name(problem, name).lower()}
            time = 100.0 * float((of_one > 0).mean())
            yield _told(key, int(of_one.max()), time=time, cutoff=cutoff, **of)


def step_facts(verification: xr.Dataset | None) -> Iterator[Fact]:
    """Loss and error with shorter steps, and with contact on the distance of units."""
    if verification is None:
        return
    for name in (str(name) for name in verification["check"].values):
        found = verification.sel(check=name)
        status = str(found["status"].item())
        for structure in ("altered", "cloaked"):
            part = found.sel(structure=structure)
            of = {"key": name.replace(" ", "_"), "structure": structure, "name": name}
            if status != "ok":
                yield _told("check_{key}_{structure}", np.nan, "—", note=status, **of)
                continue
            off = ""
            if (apart := float(part["departure"])) > 0.0:
                off = f"; units {within(apart, 'mm', 2)} from the run at most"
            yield _told(
                "check_{key}_{structure}",
                float(part["loss"]),
                error=float(part["error"]),
                steps=_steps(float(part["time_step"])),
                overlaps=overlapping(int(part["overlaps"])),
                off=off,
                **of,
            )


def _steps(length: float) -> str:
    """Tells in words how long steps are, s; NaN of steps that are not equally long."""
    graded = "steps graded in time"
    return graded if np.isnan(length) else f"steps of {worded(1e6 * length, 'µs', 4)}"
