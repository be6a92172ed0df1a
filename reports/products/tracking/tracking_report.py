"""Makes the report of a track: an overlay on its video, and one page on the recording's quality."""

import argparse
import io
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import datasets
from pipeline.datasets import provenance
from pipeline.problem.sections import Codec
from pipeline.runtime import UserError, cli
from pipeline.tracking.frames import Frame, Recording, read_frames
from pipeline.virtual_lab import encode_video
from reports.base import style
from reports.page import templating, write_page
from reports.products.tracking import advice, figure, overlay, track_quality
from reports.products.tracking.track_quality import TrackQuality
from sim.core import Image

_SHOWN = 30.0
"""Frames per second of an overlay whose own rate is not known."""


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
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
        rate = track_quality.frame_rate(track) or _SHOWN
        codec = Codec(crf=20)
        encode_video(
            args.out_dir / "overlay.mp4", overlay.images(painted, shown()), rate, codec, labels
        )
    found = track_quality.measured(track, kept, track_quality.stream_of(args.video))
    write_page(args.out_dir / "index.html", "tracking.html.j2", _values(track, asked, found))


def _check_origin(track: xr.Dataset, path: Path, video: Path) -> None:
    """Refuses a video that the track was not made of."""
    if not video.exists():
        raise UserError("no such video", file=video, remedy="check the path")
    provenance.check_parent(track, path, "video", video)


def _of_track(video: Path, asked: Recording, track: xr.Dataset) -> Iterator[Frame]:
    wanted = set(track["frame"].values.tolist())
    end = np.inf if asked.window.end is None else asked.window.end
    shown = read_frames(video, asked.window.start, end, asked.frame_rate)
    return islice((each for each in shown if each.index in wanted), len(wanted))


def _values(track: xr.Dataset, asked: Recording, found: TrackQuality) -> dict[str, object]:
    return {
        "title": asked.title or "Recording",
        "synthetic": track.attrs["synthetic"] == "yes",
        "advice": advice.advice(found),
        "lines": list(_lines(track, found)),
        "svg": _drawn(track, found, asked.load_axis),
        "sources": sorted((key, str(value)) for key, value in track.attrs.items()),
    }


def _drawn(track: xr.Dataset, found: TrackQuality, load_axis: str) -> str:
    with style.styled():
        made = figure.draw_quality(track, found, load_axis)
        held = io.StringIO()
        made.savefig(held, format="svg", metadata={"Creator": "metacloak", "Date": None})
    return templating.element(held.getvalue())


def _lines(track: xr.Dataset, found: TrackQuality) -> Iterator[tuple[str, str, str]]:
    """Yields what a line of the table is of, its value, and a note."""
    time = track["time"].values
    width, height = track["image_size"].values
    lasted = float(np.ptp(time))
    rate = f"{(len(time) - 1) / lasted:.4g} per second" if lasted > 0 else "rate not known"
    yield "Frames", f"{len(time)}", f"{rate}, {width} × {height} px"
    yield "Scale", f"{found.pixel:.4g} mm/px", f"{found.pitch:.3g} px from unit to unit"
    yield "Blur at edges", f"{found.blur:.2f} px", "standard deviation"
    yield "Stated uncertainty", *_accuracy(found.sigma, found.pixel)
    if np.isfinite(found.floor[0]):
        yield f"Scatter in {found.resting} frames at rest", *_accuracy(found.floor, found.pixel)
    else:
        yield "Scatter at rest", "not known", "no frames at rest in the beginning"
    own = "of the specimen's own make, as far as outlines tell it"
    yield "First frame less design", f"{found.residual:.3f} px", own
    yield "Units lost", f"{100 * found.lost.sum(axis=1).mean():.3g} %", "of units and frames"
    gaps = "Gaps of dropped frames"
    for label, numbers in (("Repeated frames", found.duplicates), (gaps, found.dropped)):
        told = ", ".join(map(str, numbers[:12])) + (", …" if len(numbers) > 12 else "")
        yield label, str(len(numbers)), told
    whole = f"{100 * found.stream.alone:.0f} % of the frames are held whole"
    rest = "" if found.stream.alone > 0.995 else ", the others as changes"
    yield "Codec", found.stream.codec, whole + rest


def _accuracy(of: np.ndarray, pixel: float) -> tuple[str, str]:
    place = float(np.hypot(*of[:2]) / np.sqrt(2))
    return (
        f"{place:.3f} px, {of[2]:.3f} deg",
        f"{1000 * place * pixel:.2g} µm, root mean square of x and y",
    )
