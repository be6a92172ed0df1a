"""Draws a track: an overlay on its video, and one page on how good the recording is."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import datasets
from pipeline.datasets import provenance
from pipeline.problem.sections import Codec
from pipeline.runtime import UserError, cli, write_atomically
from pipeline.tracking.frames import Frame, Recording, read_frames
from pipeline.virtual_lab import encode_video
from reports.products.tracking import overlay, page, track_quality
from sim.core import Image


def _work(args: argparse.Namespace) -> None:
    track = datasets.read(args.track, "track")
    _check_origin(track, args.track, args.video)
    asked = Recording.model_validate_json(track.attrs["recording"], context={"sim_units": True})
    with cli.progress(track.sizes["time"], "overlay") as bar:
        kept: list[Image] = []
        chosen = track_quality.sampled(track)

        def shown() -> Iterator[Frame]:
            for frame in _of_track(args.video, asked, track):
                if frame.index in chosen:
                    kept.append(frame.image.astype(np.uint8))
                bar.update()
                yield frame

        painted = overlay.painter(track, args.colour)
        labels = {"title": asked.title or args.video.stem, "comment": painted.note}
        rate = 1 / float(np.median(np.diff(track["time"].values)))
        codec = Codec(crf=20)
        encode_video(
            args.out_dir / "overlay.mp4", overlay.images(painted, shown()), rate, codec, labels
        )
    found = track_quality.measured(track, kept, track_quality.stream_of(args.video))

    with write_atomically(args.out_dir / "index.html") as aside:
        aside.write_text(page.render(track, asked, found), encoding="utf-8", newline="\n")


def _check_origin(track: xr.Dataset, path: Path, video: Path) -> None:
    """Refuses a video that the track was not made of."""
    if not video.exists():
        raise UserError("no such video", file=video, remedy="check the path")
    provenance.check_parent(track, path, "video", video)


def _of_track(video: Path, asked: Recording, track: xr.Dataset) -> Iterator[Frame]:
    """The frames of the video that the track has."""
    wanted = set(track["frame"].values.tolist())
    end = np.inf if asked.window.end is None else asked.window.end
    shown = read_frames(video, asked.window.start, end, asked.frame_rate)
    return islice((each for each in shown if each.index in wanted), len(wanted))


def main(argv: Sequence[str] | None = None) -> int:
    """Draw overlay and page; returns the exit code."""
    parser = cli.parser("reports.products.tracking.build", str(__doc__), study=False)
    parser.add_argument("--track", type=Path, required=True, metavar="NC", help="the track")
    parser.add_argument("--video", type=Path, required=True, metavar="FILE", help="its video")
    parser.add_argument("--colour", choices=overlay.SHOWN, default="displacement", help="of units")
    parser.add_argument("--out-dir", type=Path, required=True, metavar="DIR", help="for both")
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
