"""Compares both laws of contact: every structure under either, and a second design."""

from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from reports.facts import Fact, facts_of, percent, stability_facts, worded
from reports.figures.loading_path import measures
from reports.figures.loading_path.abscissa import structures
from reports.figures.loading_path.measures import over_cases
from reports.study import RedesignResults, StudyResults, display_name

_told = facts_of(__file__)


def contact_facts(study: StudyResults) -> Iterator[Fact]:
    """Loss, overlaps and gap of every structure under either law; then a second design's.

    The paper's law is that on void angles. None of a motion in time, which is run under one law.
    """
    if not study.problem.static:
        return
    names = [name for name in structures(study.response) if name != "intact"]
    yield from _by_law(study.problem, study.response, names, study.problem.contact.law)
    if study.redesign is not None:
        yield from _again(study, study.redesign)


def _by_law(
    problem: Problem, response: xr.Dataset, names: Sequence[str], own: str, whose: str = ""
) -> Iterator[Fact]:
    """Yields a row for every structure and law; the other law's tells the change from `own`."""
    losses = over_cases(problem, response["loss_by_contact"])
    unit = response["loss_by_contact"].attrs["units"]
    for name in names:
        for law in (str(law) for law in response["contact_law"].values):
            part = response.sel(structure=name, contact_law=law)
            loss = float(losses.sel(structure=name, contact_law=law))
            words = display_name(problem, name).lower()
            of = {"law": law, "whose": whose or name, "words": words, "unit": unit}
            of["second"] = whose and ", second design"
            if np.isnan(loss):
                yield _told("contact_{law}_{whose}", loss, "—", note="no result", **of)
                continue
            count = int(part["overlaps_by_contact"].max())
            gap = worded(float(part["gap_by_contact"].min()), "mm", 2)
            note = f"{overlapping(count)}, smallest gap {gap}, by geometry"
            if law != own:
                change = loss / float(losses.sel(structure=name, contact_law=own)) - 1.0
                snaps = response["snaps_by_contact"].sel(structure=name)
                apart = (snaps != snaps.sel(contact_law=own)).any()
                other = ", on another branch: one of them snaps" if apart else ""
                note = f"{percent(change)} against the {own} law{other}; {note}"
            if law == "angle":
                note += "; the paper's law"
            yield _told("contact_{law}_{whose}", loss, note=note, **of)


def overlapping(count: int) -> str:
    """Returns number of pairs of units that overlap, in words."""
    if count == 0:
        return "none overlap"
    return "1 pair of units overlaps" if count == 1 else f"{count} pairs of units overlap"


def _again(study: StudyResults, again: RedesignResults) -> Iterator[Fact]:
    """Yields the design for contact on distance, in a lattice that obeys it too."""
    words = "the same: its losses by both laws are alike"
    if again.changed:
        words = f"optimised again, {again.evaluations} evaluations"
    yield _told("second_design", np.nan, words)
    if again.changed:
        yield from _by_law(study.problem, again.response, ["cloaked"], "angle", "second")
    loss = over_cases(study.problem, again.response["loss"])
    start, end = (float(loss.sel(structure=name)) for name in ("altered", "cloaked"))
    yield _told("second_loss_reduction", 1.0 - end / start)
    measure = measures.measure_of(study.problem)
    values = over_cases(study.problem, measure.of(again.response)).isel(time=-1)
    altered, cloaked = (float(values.sel(structure=name)) for name in ("altered", "cloaked"))
    of = {"key": measure.key, "what": f"{measure.label[0].lower()}{measure.label[1:]}"}
    of |= {"before": worded(altered, measure.unit, 3), "after": worded(cloaked, measure.unit, 3)}
    yield _told("second_{key}_reduction", 1.0 - cloaked / altered, **of)
    part = again.response.sel(structure="cloaked")
    gap = worded(float(part["min_gap"].min()), "mm", 2)
    yield _told("second_overlaps", int(part["overlaps"].max()), gap=gap)
    yield from stability_facts("second_design", part, "second design")
    history = again.design.isel(method=0)
    violation = float(history["violation"].isel(evaluation=int(history["best_evaluation"])))
    yield _told("second_violation", violation)
