"""Stage: compares a recording with the simulation of what it shows."""

import argparse
import json
import logging
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import datasets, problem
from pipeline.comparison import (
    Compared,
    assemble_comparison,
    describe_comparison,
    drive_direction,
    find_axis,
    interpolate_response,
    list_quantities,
    often_seen,
    pixel_size,
    prepare_measurement,
    select_frames,
    simulate_specimen,
    untared_force,
)
from pipeline.datasets import provenance
from pipeline.posing import read_design, scene_of, structures_of
from pipeline.problem import Problem
from pipeline.runtime import UserError
from pipeline.tracking.frames import Recording
from pipeline.tracking.frames import recording as recordings
from pipeline.tracking.geometry import as_built
from pipeline.virtual_lab import select_structure

LOG = logging.getLogger(__name__)
_OPPOSED_CORRELATION = -0.5
"""Correlation of forces below which a load cell is thought to count the other way."""


def work(args: argparse.Namespace) -> None:
    """Reads both sides, compares them, writes the comparison.

    Raises:
        UserError: the recording and the study do not belong together, or cannot be aligned.
    """
    asked = problem.load(args.problem, args.preset)
    recording = recordings.load_recording(args.recording)
    files = {name: getattr(args, name) for name in ("design", "response", "track")}
    try:
        made = both_sides(asked, recording, args)
    except UserError as error:
        error.file = error.file or str(args.recording)
        raise
    dataset = assemble_comparison(made)
    origin = {
        **provenance.of_study(asked, "compare", parents=files, plan=_plan(made)),
        "recording": recording.model_dump_json(),
        "synthetic": made.measurement.track.attrs["synthetic"],
    }
    datasets.write(
        dataset.assign_attrs(_attributes(asked, recording, made)), args.out, "comparison", origin
    )
    _log_metrics(dataset)


def both_sides(asked: Problem, recording: Recording, args: argparse.Namespace) -> Compared:
    """Prepares both sides of a recording, at the frames of its track.

    Raises:
        UserError: they do not belong together, or cannot be aligned.
    """
    design = read_design(asked, args.design)
    every_case = datasets.read(args.response, "response")
    provenance.check_parent(every_case, args.response, "design", args.design)
    response = chosen(every_case, recording)
    built = as_built(design, recording.structure)
    structure = structures_of(scene_of(asked, args.problem.parent), design)[recording.structure]
    scene = structure.scene
    drive = scene.loads.cases[0]
    leading = scene.lattice.id[drive.leading]
    every = prepare_measurement(datasets.read(args.track, "track"), built, leading)
    axis = find_axis(every.time, every.drive, response, static=asked.static, moved=drive.displaces)
    frequency = np.nan if asked.frequency is None else asked.frequency
    _check_zero(untared_force(every.force, axis.at_rest), recording, args.recording)
    kept = select_frames(axis.time, 1 / frequency)
    measured, shown = every.select(kept), axis.select(kept)
    way = drive_direction(response)
    seen = often_seen(measured.displacement)
    return Compared(
        measurement=measured,
        axis=shown,
        simulation=simulate_specimen(
            asked, structure, measured.track, measured.time, way, args.threads
        ),
        nominal=interpolate_response(response, shown.time),
        quantities=list_quantities(asked, every_case.isel(case=recording.case), shown.time, seen),
        design=built,
        frequency=frequency,
        level=asked.prediction.level,
        pixel=(
            pixel_size(measured.track, np.nanmean(measured.centre, axis=0)),
            recording.pixel_size or np.nan,
        ),
    )


def _check_zero(untared: float, recording: Recording, path: Path) -> None:
    """Warns of a load cell that was not tared, unless the recording tells its zero."""
    cell = recording.load_cell
    if cell is not None and "zero" not in cell.model_fields_set and np.isfinite(untared):
        LOG.warning(
            "%s: load_cell.zero: the force is %.3g N before the drive begins; write `zero: start`"
            " to take it off, or `zero: file` to keep it",
            path,
            untared,
        )


def chosen(response: xr.Dataset, recording: Recording) -> xr.Dataset:
    """Selects the structure and load case of a response that a recording shows.

    Raises:
        UserError: the response has none such.
    """
    one = select_structure(response, recording.structure)
    if recording.case >= (cases := one.sizes["case"]):
        remedy = f"give a number from 0 to {cases - 1}"
        raise UserError(
            "the study has no such load case", key="case", value=recording.case, remedy=remedy
        )
    return one.isel(case=recording.case)


def _plan(made: Compared) -> dict[str, object]:
    """Records what was decided, and what is missing."""
    return {
        "frames": len(made.measurement.frames),
        "units_by_use": np.bincount(made.measurement.use, minlength=5).tolist(),
        "beyond_the_response": int(np.isnan(made.axis.time).sum()),
        "failures": list(made.simulation.failures),
    }


def _attributes(asked: Problem, recording: Recording, made: Compared) -> dict[str, str]:
    """Describes in attributes how both sides were brought together."""
    return {
        "title": recording.title or f"{recording.structure} structure",
        "structure": recording.structure,
        "case": str(recording.case),
        **describe_comparison(asked, made),
    }


def _log_metrics(dataset: xr.Dataset) -> None:
    """Logs the distance of the sides in a line."""
    nrmse = dataset["nrmse"].sel(side="simulated", estimate="value").values
    correlation = dataset["correlation"].sel(side="simulated", estimate="value").values
    LOG.info(
        "%d frames, %d units; residual %s %% of the motion, correlation %s (ux, uy, theta)",
        dataset.sizes["time"],
        int((dataset["use"] == 0).sum()),
        json.dumps([round(100 * float(each), 1) for each in nrmse]),
        json.dumps([round(float(each), 4) for each in correlation]),
    )
    force_correlation = float(xr.corr(dataset["load_force"], dataset["simulated_force"]))
    if force_correlation < _OPPOSED_CORRELATION:
        LOG.warning(
            "the load cell's force falls where the simulated one rises (correlation %.2f); if it"
            " counts against the drive, write load_cell: {reversed: true} in the recording",
            force_correlation,
        )
