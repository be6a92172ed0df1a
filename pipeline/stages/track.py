"""Stage: turns the video of a specimen into the motions of its units, with their uncertainty."""

import argparse
import json
import logging
import os
import shlex
from contextlib import suppress
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import datasets
from pipeline.datasets import SYNTHETIC_LABEL, provenance
from pipeline.runtime import (
    PREFIX,
    UserError,
    cli,
    found_in,
    sidecar_path,
    write_atomically,
)
from pipeline.tracking.detect import specimen_orientation
from pipeline.tracking.frames import (
    VIDEOS,
    Frame,
    LoadCellLog,
    MissingTimesError,
    Recording,
    frame_count,
    has_uneven_intervals,
    import_video,
    is_own_drawing,
    load_cell,
    orientation_of,
    read_frames,
    read_pictures,
    recording,
    rendered,
    video_length,
    write_drawing,
)
from pipeline.tracking.frames import recording as recordings
from pipeline.tracking.geometry import as_built, clamped_units, outlines_of_design
from pipeline.tracking.motion import (
    DROPPED,
    Patch,
    Track,
    follow_patch,
    median_uncertainty,
    square,
    track_video,
    transform_outline,
)
from pipeline.tracking.output import (
    assemble_track,
    check_drive_axis,
    dic_points,
    track_table_path,
    write_track_table,
)
from pipeline.tracking.reference_frame import RecordingSetup, proposal
from sim.core import Floats, Ints

LOG = logging.getLogger(__name__)

_PAIR_HEADING = "x_px,y_px,u_px,v_px,rotation_deg"
_ORANGE = (0, 80, 230)  # blue, green, red
_UNTIMED = "frame_rate: how many pictures were taken in a second; without it they are not tracked"


def work(args: argparse.Namespace) -> None:
    """Imports a description, or tracks a recording.

    Raises:
        UserError: a fault of the files, or a video that does not show the design.
    """
    if args.words[0] == "pair":
        _match_pair(*(Path(word) for word in args.words[1:]), args=args)
        return
    *command, file = args.words
    known = {"": _track, "init": _write_proposal, "points": _convert_points, "import": _import}
    if (name := " ".join(command)) not in known:
        remedy = "give one of init, points, import, pair, or a recording alone; see --help"
        raise UserError("no such command", value=name, remedy=remedy)
    wanted = {"": "out", "points": "out", "init": "design"}.get(name)
    if wanted is not None and getattr(args, wanted) is None:
        usage = f"python -m pipeline track {name} {file}".replace("  ", " ")
        remedy = f"{usage} --{wanted} FILE.nc; see --help"
        raise UserError(f"--{wanted} is wanted", remedy=remedy)
    known[name](Path(file), args)


def _convert_points(path: Path, args: argparse.Namespace) -> None:
    asked = dic_points.load(path)
    source = _design(asked.design, path, args.design)
    design = as_built(datasets.read(source, "design"), asked.structure)
    held = path.parent / asked.points
    table = track_table_path(args.out, path, held)
    with found_in(path):
        seen = dic_points.read_points(held, asked)
        made = dic_points.track(design, seen, asked.subset)
    parents = {"design": source, "points": held}
    origin = provenance.of_recording(asked.model_dump_json(), parents, synthetic=asked.synthetic)
    datasets.write(made, args.out, "track", origin)
    write_track_table(made.assign_attrs(origin), table)


def _write_proposal(video: Path, args: argparse.Namespace) -> None:
    _check_positive("--pixel-size", args.pixel_size, "millimetres per pixel, or leave it out")
    design = datasets.read(args.design, "design")
    first, timed = _first_frame(video, args.start, args.frame_rate)
    scale = None if args.pixel_size is None else 1 / args.pixel_size
    with found_in(video):
        found = proposal.propose(first.image, design, scale)
    warnings = found.warnings if timed else (*found.warnings, _UNTIMED)
    out = args.out_dir / f"{video.stem}.yaml"
    if out.exists():
        raise _already_exists(out)
    drawn = sidecar_path(out, video, ending="_units.png", is_own=is_own_drawing, key="--out-dir")
    values = {
        "title": video.stem,
        "video": os.path.relpath(video.resolve(), out.resolve().parent),
        "design": os.path.relpath(args.design.resolve(), out.resolve().parent),
        "structure": found.structure,
        "pixel_size": f"{found.pixel_size:.4g} mm",
        "mirrored": specimen_orientation(found.detection.camera)[1] or None,
        "frame_rate": None if args.frame_rate is None else f"{args.frame_rate:.12g} Hz",
        "window": {"start": f"{args.start:.12g} s"},
        "synthetic": rendered(video) or None,
    }
    note = SYNTHETIC_LABEL if rendered(video) else ""
    write_drawing(proposal.draw_proposal(first.image, found, note), drawn)
    with write_atomically(out) as aside:
        comments = ("What the first frame did not tell:", *warnings)
        aside.write_text(recording.recording_yaml(values, comments), encoding="utf-8")
    seen = f"{len(found.detection.unit)} of {found.specimen.count} units, {found.kind}"
    LOG.info("%s: %s, %.4g mm/px; see %s", out, seen, found.pixel_size, drawn)
    for warning in warnings:
        LOG.info("not told: %s", warning)


def _first_frame(video: Path, start: float, rate: float | None) -> tuple[Frame, bool]:
    """Reads the first frame of a window, and tells whether its time is known."""
    if not 0.0 <= start < np.inf:
        remedy = "give seconds since the file's first frame"
        raise UserError("no time of the video", key="--start", value=start, remedy=remedy)
    _check_positive("--frame-rate", rate, "frames per second")
    timed = True
    try:
        first = next(read_frames(video, start, rate=rate), None)
    except MissingTimesError as error:
        if start:
            remedy = "tell how many were taken in a second, such as --frame-rate 300"
            raise UserError(error.what, file=video, key="--frame-rate", remedy=remedy) from error
        first, timed = next(read_frames(video, rate=1.0), None), False
    if first is None:
        remedy = "start earlier" if start else "give another file"
        raise UserError(f"the video has no frame from {start:g} s on", file=video, remedy=remedy)
    return first, timed


def _check_positive(option: str, value: float | None, wanted: str) -> None:
    if value is not None and not 0.0 < value < np.inf:
        what, remedy = "no finite number above zero", f"give {wanted}"
        raise UserError(what, key=option, value=value, remedy=remedy)


def _match_pair(*pictures: Path, args: argparse.Namespace) -> None:
    import cv2

    if len(pictures) != 2 or args.out is None or len(args.at or []) % 2 or not args.at:
        usage = "python -m pipeline track pair FIRST.png LATER.png --at X Y --out motions.csv"
        raise UserError("two pictures, x and y of patches, and a file are wanted", remedy=usage)
    _check_positive("--side", args.side, "pixels, such as 41")
    drawing = sidecar_path(args.out, *pictures, ending=".png", is_own=is_own_drawing)
    before, after = read_pictures(*pictures)
    centres = np.reshape(args.at, (-1, 2))
    for centre in centres:
        if not (centre >= 0.0).all() or not (centre < before.shape[::-1]).all():
            remedy = f"give x to {before.shape[1] - 1} and y to {before.shape[0] - 1}"
            what, value = "a patch lies outside of the picture", centre.tolist()
            raise UserError(what, file=pictures[0], key="--at", value=value, remedy=remedy)
    drawn, rows = cv2.cvtColor(after, cv2.COLOR_GRAY2BGR), [_PAIR_HEADING]
    for centre in centres:
        outline = square(centre, args.side)
        motion = follow_patch(Patch(before, after, outline, centre))
        row = (*centre, *motion[:2], np.rad2deg(motion[2]))
        rows.append(",".join("" if np.isnan(one) else f"{one:.6g}" for one in row))
        if np.isnan(motion).any():
            LOG.warning("nothing like the patch at %g, %g is seen again", *centre)
            continue
        LOG.info("%g, %g moved by %.4f, %.4f px and turned by %.3f deg", *row)
        corners = np.round(16 * transform_outline(outline, centre, motion)).astype(np.int32)
        cv2.polylines(drawn, [corners], True, _ORANGE, 1, cv2.LINE_AA, 4)
    with write_atomically(args.out) as aside:
        aside.write_text("\n".join(rows) + "\n", encoding="utf-8")
    write_drawing(drawn, drawing)


def _import(path: Path, args: argparse.Namespace) -> None:
    described = import_video.description(path)
    shown = import_video.video_of(path) if args.video is None else args.video
    name, folder = shown.stem, args.out_dir
    out, design = folder / f"{name}_recording.yaml", folder / f"{name}_design.nc"
    text = import_video.recording_text(described, shown.resolve(), design.name)
    if out.exists() and out.read_text(encoding="utf-8") != text:
        raise _already_exists(out)
    described_by = provenance.file_hash(path)
    if design.exists() and not _is_imported(design):
        raise UserError("there is a design already", file=design, remedy="remove it, or --out-dir")
    origin = {
        "problem": "{}",
        "problem_hash": described_by,
        "parents": json.dumps({"description": described_by}),
    }
    datasets.write(import_video.design(described), design, "design", origin)
    with write_atomically(out) as aside:
        aside.write_text(text, encoding="utf-8")
    LOG.info("python -m pipeline track %s --out %s", out, "track.nc")


def _is_imported(path: Path) -> bool:
    """Tests whether a design was imported from a description, which may have changed since."""
    with suppress(UserError):
        parents = json.loads(datasets.read(path, "design").attrs["parents"])
        return list(parents) == ["description"]
    return False


def _already_exists(out: Path) -> UserError:
    return UserError("there is a recording already", file=out, remedy="remove it, or --out-dir")


def _track(path: Path, args: argparse.Namespace) -> None:
    if path.is_dir() or path.suffix.lower() in VIDEOS:
        remedy = f"python -m pipeline track init {path} --design NC proposes a recording of it"
        raise UserError("a video, where a recording is wanted", file=path, remedy=remedy)
    asked = recordings.load_recording(path)
    video, source = _sources(asked, path, args.design)
    design = as_built(datasets.read(source, "design"), asked.structure)
    if asked.load_axis == "driven displacement":
        check_drive_axis(design, path)
    parents, log = {"design": source, "video": video}, None
    if asked.load_cell is not None:
        held = parents["load_cell"] = path.parent / asked.load_cell.file
        log = _read_load_log(asked, asked.load_cell, held, video)
    out, partial = args.out, args.out.with_name(f"{args.out.stem}_partial.nc")
    table, other = (track_table_path(each, path, *parents.values()) for each in (out, partial))
    track = track_recording(asked, design, video, path)
    force = None
    if log is not None and asked.load_cell is not None:
        resting = track.resting if asked.load_cell.zero == "start" else 0
        force = load_cell.forces(log, track.start + track.time, resting)
    if force is not None and not np.isfinite(force).any():
        LOG.warning("the load cell's log holds no force at the times of the frames")
    made = assemble_track(design, track, force)
    synthetic = asked.synthetic or rendered(video)
    origin = provenance.of_recording(asked.model_dump_json(), parents, synthetic=synthetic)
    if track.ended is not None:  # a build deletes what a rule that failed was to make
        out, table = partial, other
    datasets.write(made, out, "track", origin)
    write_track_table(made.assign_attrs(origin), table)
    if track.ended is not None:
        LOG.warning("the %d frames until then are kept in %s", len(track.time), out)
        raise track.ended
    if not args.no_report:
        words = ["--track", str(args.out), "--video", str(video), "--out-dir"]
        command = shlex.join([*words, str(args.out.with_name(f"{args.out.stem}_report"))])
        LOG.info("overlay and quality page: python -m %sreports tracking %s", PREFIX, command)


def _read_load_log(
    asked: Recording, cell: LoadCellLog, held: Path, video: Path
) -> load_cell.ForceLog:
    """Reads a load cell's log, refused before the tracking if it holds nothing of the video."""
    log = load_cell.read(held, cell)
    end = np.inf if asked.window.end is None else asked.window.end
    window = asked.window.start, min(end, video_length(video, asked.frame_rate))
    load_cell.check(log, window, held, cell)
    return log


def _sources(asked: Recording, path: Path, study: Path | None) -> tuple[Path, Path]:
    if asked.video is None:
        remedy = "render it first (python -m pipeline film) and track the YAML beside it"
        raise UserError("a recording without a video", file=path, key="virtual", remedy=remedy)
    video = path.parent / asked.video
    if asked.sha256 is not None and video.is_file() and datasets.file_hash(video) != asked.sha256:
        what = f"damaged: {asked.video} is not the video that was described"
        remedy = "copy or render it again, or remove this key if the change was meant"
        raise UserError(what, file=path, key="sha256", value=asked.sha256, remedy=remedy)
    return video, _design(asked.design, path, study)


def _design(named: str | None, path: Path, study: Path | None) -> Path:
    """The design that a YAML names, or that of its study."""
    if named is not None:
        return path.parent / named
    if study is None:
        remedy = "add the path of the specimen's design dataset, or give --design"
        raise UserError("no design is named", file=path, key="design", remedy=remedy)
    return study


def readout_of(asked: Recording, video: Path, source: Path) -> float:
    """Returns the time from the first row of the pictures as they are shown to the last, s.

    Raises:
        UserError: the camera's rows are columns of theirs.
    """
    if not asked.readout:
        return 0.0
    shown = orientation_of(video)
    if shown.transposed:
        what = "the video is shown turned by a quarter, so that the camera's rows are its columns"
        remedy = "film with the phone held across, or leave readout out"
        raise UserError(what, file=source, key="readout", value=asked.readout, remedy=remedy)
    return -asked.readout if shown.rows_reversed else asked.readout


def warn_of_times(time: Floats, timing: Ints, video: Path) -> None:
    """Warns of times (frames,), s, that have gaps, or that have none where frames are missing."""
    gaps = np.count_nonzero(timing == DROPPED)
    if not has_uneven_intervals(time):
        if gaps:
            LOG.warning(
                "by the motion, frames were dropped in %d gaps, which the times do not have: later"
                " ones may be too early",
                gaps,
            )
    elif video.is_dir():
        LOG.warning("numbers are missing among the pictures' names; times have gaps there")
    else:
        LOG.warning("the frame rate varies; times are the file's own stamps")


def track_recording(asked: Recording, design: xr.Dataset, video: Path, source: Path) -> Track:
    """The track of a recording, told about in a line at its end.

    Raises:
        UserError: naming the recording's file where the video does not show the design.
    """
    end = np.inf if asked.window.end is None else asked.window.end
    shown = read_frames(video, asked.window.start, end, asked.frame_rate)
    scale = None if asked.pixel_size is None else 1 / asked.pixel_size
    setup = RecordingSetup(
        asked.thickness,
        asked.camera_distance,
        asked.specimen,
        asked.turned,
        asked.mirrored,
        asked.exposure,
        readout_of(asked, video, source),
        clamped_units(design),
        asked.camera == "follows supports",
    )
    with found_in(source), cli.progress(frame_count(video), "tracking") as bar:
        track = track_video(shown, outlines_of_design(design), scale, bar.update, setup)
    warn_of_times(track.time, track.timing, video)
    lost = float(np.mean(track.quality != 0))
    place, turn = median_uncertainty(track.sigma)
    LOG.info(
        "%d frames, %d units; %.2f %% not seen; median uncertainty %.4f mm (root mean square of x"
        " and y), %.3f deg; %d timing faults",
        len(track.time),
        track.quality.shape[1],
        100 * lost,
        place,
        np.rad2deg(turn),
        np.count_nonzero(track.timing),
    )
    return track
