"""Stage: films a simulated response, so that a study has a recording before a lab has made one."""

import argparse
import logging
import os
from contextlib import suppress
from pathlib import Path

import xarray as xr

from pipeline import datasets
from pipeline.datasets import SYNTHETIC_LABEL, provenance
from pipeline.problem.sections import VirtualRecording, write_quantity
from pipeline.runtime import UserError, begins_with, cli, found_in, sidecar_path, write_atomically
from pipeline.tracking.frames import Recording
from pipeline.tracking.frames import recording as recordings
from pipeline.tracking.geometry import outlines_of_design
from pipeline.tracking.output import check_drive_axis
from pipeline.virtual_lab import (
    assemble_truth,
    encode_video,
    load_cell_log,
    noise_planning,
    prepare_film,
    select_case,
    select_structure,
)

LOG = logging.getLogger(__name__)

SYNTHETIC = f"{SYNTHETIC_LABEL}: rendered from a simulation, not filmed"
_OWN_COMMENT = "Written by the stage film; python -m pipeline track takes it."


def work(args: argparse.Namespace) -> None:
    """Renders a recording, weighs what it shows, or plans one.

    Raises:
        UserError: a fault of the files or of the choices.
    """
    if args.command == "render":
        _render(args.recording, args.response, args.design, args.out)
    elif args.command == "weigh":
        _write_load_log(args.recording, args.response, args.out)
    else:
        _plan(args)


def _plan(args: argparse.Namespace) -> None:
    import pandas as pd

    asked = recordings.Recording(virtual=VirtualRecording())
    if args.recording is not None:
        asked = recordings.load_recording(args.recording)
    if asked.virtual is not None and asked.virtual.specimen is not None:
        LOG.info("virtual.specimen is left out: clips show the design's own response")
    response = datasets.read(args.response, "response")
    structure = args.structure or asked.structure
    case = asked.case if args.case is None else args.case
    base = noise_planning.PlannedSetup(
        "bare" if asked.specimen == "auto" else asked.specimen,
        asked.virtual or VirtualRecording(),
        outlines_of_design(select_structure(response, structure)).pitch,
    )
    values = (args.specimen, args.pixels_per_pitch, args.fps, args.codec, args.marker)
    chosen = noise_planning.setup_combinations(
        base, noise_planning.SetupOptions(*(tuple(each or ()) for each in values))
    )
    rows = []
    with cli.progress(len(chosen), "planning") as bar:
        for choice in chosen:
            found = noise_planning.expected_noise(response, structure, case, choice, args.frames)
            rows.append({**choice.columns, **found.columns})
            bar.update()
    LOG.info("%s; errors of clips of %d frames", SYNTHETIC, args.frames)
    table = pd.DataFrame(rows)
    for line in table.to_string(index=False).splitlines():
        LOG.info("%s", line)
    if args.csv is not None:
        with write_atomically(args.csv) as aside:
            table.to_csv(aside, index=False, lineterminator="\n")


def _render(path: Path, response: Path, design: Path, out: Path) -> None:
    asked, virtual = _load_virtual(path)
    described = sidecar_path(out, path, ending=".yaml", is_own=begins_with(_OWN_COMMENT))
    truth = sidecar_path(out, response, design, ending="_truth.nc", is_own=_is_truth)
    if out.suffix not in virtual.codec.suffixes:
        what = f"{virtual.codec.name} does not go into such a file"
        raise UserError(what, file=out, remedy=f"name it *{virtual.codec.suffixes[0]}")
    if asked.load_axis == "driven displacement":
        check_drive_axis(datasets.read(design, "design"), path)
    parents = {"response": response, "design": design}
    origin = provenance.of_recording(asked.model_dump_json(), parents, synthetic=True)
    with found_in(path):
        film = prepare_film(
            _load_response(asked, response), asked.structure, asked.specimen, virtual
        )
    title = asked.title or path.stem
    labels = {"title": f"{SYNTHETIC_LABEL}: {title}", "comment": SYNTHETIC}
    with cli.progress(len(film.motion.time), f"rendering {path.stem}") as bar:
        encode_video(out, film.images(bar.update), virtual.rate, virtual.codec, labels)
    made = assemble_truth(film.response, film.present, film.motion, film.scene.view)
    datasets.write(made, truth, "truth", origin)
    comments = (SYNTHETIC, _OWN_COMMENT)
    with write_atomically(described) as aside:
        text = recordings.recording_yaml(_recording_values(asked, virtual, out, design), comments)
        aside.write_text(text, encoding="utf-8")
    log = out.with_name(f"{out.stem}_load.csv")
    if virtual.load_cell is not None and not log.exists():
        words = "`python -m pipeline film weigh` writes the log of its load cell, %s"
        LOG.info(words, log)


def _is_truth(path: Path) -> bool:
    with suppress(UserError):
        datasets.read(path, "truth")
        return True
    return False


def _write_load_log(path: Path, response: Path, out: Path) -> None:
    asked, virtual = _load_virtual(path)
    if virtual.load_cell is None:
        remedy = "describe the load cell there"
        raise UserError("no load cell", file=path, key="virtual.load_cell", remedy=remedy)
    with found_in(path):
        lines = load_cell_log(_load_response(asked, response), virtual, virtual.load_cell)
    with write_atomically(out) as aside, aside.open("w", encoding="utf-8") as file:
        file.write(f"# {SYNTHETIC}\ntime,force\n")
        file.writelines(f"{time:.12g},{force:.5f}\n" for time, force in lines)


def _load_virtual(path: Path) -> tuple[Recording, VirtualRecording]:
    asked = recordings.load_recording(path)
    if asked.virtual is None:
        remedy = "track it (python -m pipeline track), or say under `virtual` how to render it"
        raise UserError("a recording that was filmed", file=path, key="video", remedy=remedy)
    return asked, asked.virtual


def _load_response(asked: Recording, response: Path) -> xr.Dataset:
    """Loads what is filmed: a specimen, or the response at the structure and the case."""
    assert asked.virtual is not None
    if asked.virtual.specimen is not None:
        return datasets.read(response, "specimen")
    return select_case(datasets.read(response, "response"), asked.structure, asked.case)


def _recording_values(
    asked: Recording, virtual: VirtualRecording, video: Path, design: Path
) -> dict[str, object]:
    cell = virtual.load_cell
    log = None if cell is None else {"file": f"{video.stem}_load.csv", "offset": cell.offset}
    return {
        "title": asked.title or None,
        "video": video.name,
        "sha256": datasets.file_hash(video),
        "design": os.path.relpath(design.resolve(), video.resolve().parent),
        "structure": asked.structure,
        "case": asked.case,
        "pixel_size": f"{virtual.camera.pixel_size:g} mm",
        "thickness": f"{virtual.look.thickness:g} mm",
        "camera_distance": f"{virtual.camera.distance:g} mm",
        **_viewing_keys(asked),
        "load_axis": asked.load_axis,
        "load_cell": log,
        "synthetic": True,
    }


def _viewing_keys(asked: Recording) -> dict[str, object]:
    """Lists how the video is to be read, as the recording that it is rendered by tells."""
    window, default = asked.window, Recording.model_fields["camera"].default
    ends = {"start": window.start or None, "end": window.end}
    shown = {key: write_quantity(time, "s") for key, time in ends.items() if time is not None}
    return {
        "turned": None if asked.turned is None else write_quantity(asked.turned, "rad"),
        "mirrored": asked.mirrored,
        "exposure": None if asked.exposure is None else write_quantity(asked.exposure, "s"),
        "camera": None if asked.camera == default else asked.camera,
        "window": shown or None,
    }
