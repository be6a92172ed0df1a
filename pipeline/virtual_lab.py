"""Stage: films a simulated response, so that a study has a recording before a lab has made one."""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline import cli
from pipeline.errors import UserError
from pipeline.tracking.origin import WORD

if TYPE_CHECKING:
    from pipeline.lab.filming import Filming
    from pipeline.tracking.recording import Recording

LOG = logging.getLogger(__name__)

SYNTHETIC = f"{WORD}: rendered from a simulation, not filmed"
DESCRIPTION = """\
Film a simulated response.

  python -m pipeline.virtual_lab render RECORDING.yaml --response NC --design NC --out VIDEO.mp4
  python -m pipeline.virtual_lab plan [RECORDING.yaml] --response NC [choices]

The first writes the video, beside it VIDEO.yaml, which pipeline.track takes, and VIDEO_truth.nc.
The second renders short clips with each of the choices, tracks them, and tells what noise to
expect. Choices that are given several values are tried in every combination.
"""


def parser() -> argparse.ArgumentParser:
    """The stage's command line."""
    made = cli.parser("pipeline.virtual_lab", DESCRIPTION, study=False)
    commands = made.add_subparsers(dest="command", required=True)
    render = commands.add_parser("render", help="write a video", allow_abbrev=False)
    render.add_argument("recording", type=Path, metavar="RECORDING.yaml")
    render.add_argument("--design", type=Path, required=True, metavar="NC", help="the design")
    render.add_argument("--out", type=Path, required=True, metavar="VIDEO", help="*.mp4 or *.mkv")
    plan = commands.add_parser("plan", help="what noise to expect", allow_abbrev=False)
    plan.add_argument("recording", type=Path, nargs="?", metavar="RECORDING.yaml")
    plan.add_argument("--structure", choices=("intact", "altered", "cloaked"))
    plan.add_argument("--case", type=int, help="number of the load case")
    plan.add_argument("--frames", type=int, default=24, help="of each clip (24)")
    plan.add_argument("--specimen", nargs="+", choices=("dots", "speckle", "bare"))
    plan.add_argument("--pixels-per-pitch", type=float, nargs="+", metavar="PX")
    plan.add_argument("--fps", type=float, nargs="+", metavar="HZ")
    plan.add_argument("--codec", nargs="+", metavar="NAME", help="ffv1, h264, h264-intra, h264:28")
    plan.add_argument("--marker", type=float, nargs="+", metavar="MM", help="diameter of the dots")
    plan.add_argument("--csv", type=Path, metavar="FILE", help="also write the table to this file")
    for command in (render, plan):
        command.add_argument("--response", type=Path, required=True, metavar="NC")
        command.add_argument("--log", type=Path, metavar="FILE", default=argparse.SUPPRESS)
        command.add_argument("--quiet", action="store_true", default=argparse.SUPPRESS)
    return made


def work(args: argparse.Namespace) -> None:
    """Renders a recording, or plans one.

    Raises:
        UserError: a fault of the files or of the choices.
    """
    if args.command == "render":
        _render(args.recording, args.response, args.design, args.out)
    else:
        _plan(args)


def _plan(args: argparse.Namespace) -> None:
    import csv

    from pipeline import datasets
    from pipeline.lab import planning
    from pipeline.lab.filming import of_structure
    from pipeline.lab.setup import Virtual
    from pipeline.tracking import recording as recordings
    from pipeline.tracking.specimen import of_design
    from pipeline.whole import whole

    asked = recordings.Recording(virtual=Virtual())
    if args.recording is not None:
        asked = recordings.load(args.recording)
    response = datasets.read(args.response, "response")
    structure = args.structure or asked.structure
    case = asked.case if args.case is None else args.case
    base = planning.Choice(
        "bare" if asked.specimen == "auto" else asked.specimen,
        asked.virtual or Virtual(),
        of_design(of_structure(response, structure)).pitch,
    )
    values = (args.specimen, args.pixels_per_pitch, args.fps, args.codec, args.marker)
    chosen = planning.choices(base, planning.Options(*(tuple(each or ()) for each in values)))
    rows = []
    with cli.progress(len(chosen), "planning") as bar:
        for choice in chosen:
            found = planning.expected(response, structure, case, choice, args.frames)
            rows.append({**choice.words, **found.words})
            bar.update()
    LOG.info("%s; errors of clips of %d frames", SYNTHETIC, args.frames)
    for line in planning.table(rows):
        LOG.info("%s", line)
    if args.csv is not None:
        with whole(args.csv) as aside, aside.open("w", encoding="utf-8", newline="") as file:
            table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            table.writeheader()
            table.writerows(rows)


def _render(path: Path, response: Path, design: Path, out: Path) -> None:
    from pipeline import datasets, provenance
    from pipeline.lab import truth
    from pipeline.lab.encode import encode
    from pipeline.tracking import recording as recordings
    from pipeline.whole import whole

    asked = recordings.load(path)
    if asked.virtual is None:
        remedy = "track it: python -m pipeline.track; or describe how to render it under `virtual`"
        raise UserError("a recording that was filmed", file=path, key="video", remedy=remedy)
    if out.suffix not in asked.virtual.codec.suffixes:
        raise UserError(
            f"{asked.virtual.codec.name} does not go into such a file",
            file=out,
            remedy=f"name it *{asked.virtual.codec.suffixes[0]}",
        )
    parents = {"response": response, "design": design}
    origin = provenance.recorded(asked.model_dump_json(), parents, synthetic=True)
    film = _prepared(asked, path, response)
    title = asked.title or path.stem
    labels = {"title": f"{WORD}: {title}", "comment": SYNTHETIC}
    with cli.progress(len(film.motion.time), f"rendering {path.stem}") as bar:
        encode(out, film.images(bar.update), asked.virtual.rate, asked.virtual.codec, labels)
    made = truth.dataset(film.response, film.present, film.motion, film.scene.view)
    datasets.write(made, out.with_name(f"{out.stem}_truth.nc"), "truth", origin)
    comments = (SYNTHETIC, "Written by pipeline.virtual_lab; python -m pipeline.track takes it.")
    with whole(out.with_suffix(".yaml")) as aside:
        text = recordings.text(_described(asked, out, design), comments)
        aside.write_text(text, encoding="utf-8")


def _prepared(asked: Recording, path: Path, response: Path) -> Filming:
    from pipeline import datasets
    from pipeline.lab.filming import prepared

    held = datasets.read(response, "response")
    assert asked.virtual is not None
    try:
        return prepared(held, asked.structure, asked.case, asked.specimen, asked.virtual)
    except UserError as error:
        error.file = error.file or str(path)
        raise


def _described(asked: Recording, video: Path, design: Path) -> dict[str, object]:
    """Keys and values of a recording of the rendered video."""
    assert asked.virtual is not None
    return {
        "title": asked.title or None,
        "video": video.name,
        "design": os.path.relpath(design.resolve(), video.resolve().parent),
        "structure": asked.structure,
        "case": asked.case,
        "pixel_size": f"{asked.virtual.camera.pixel_size:g} mm",
        "thickness": f"{asked.virtual.look.thickness:g} mm",
        "camera_distance": f"{asked.virtual.camera.distance:g} mm",
        "load_axis": asked.load_axis,
        "synthetic": True,
    }


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    return cli.run(work, parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
