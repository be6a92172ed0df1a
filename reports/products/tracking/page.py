"""The page on the quality of a recording."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline.tracking.frames import Recording
from reports.base import style
from reports.page import templating
from reports.products.tracking import advice, figure
from reports.products.tracking.track_quality import TrackQuality


class Line(NamedTuple):
    """A line of the page's table."""

    label: str
    value: str
    note: str = ""


def render(track: xr.Dataset, asked: Recording, found: TrackQuality) -> str:
    """HTML of the page, its figure within it."""
    values = {
        "title": asked.title or "Recording",
        "synthetic": track.attrs["synthetic"] == "yes",
        "advice": advice.advice(found),
        "lines": list(_lines(track, found)),
        "svg": _drawn(track, found, asked.load_axis),
        "sources": sorted((key, str(value)) for key, value in track.attrs.items()),
    }
    return templating.rendered("tracking.html.j2", values)


def _drawn(track: xr.Dataset, found: TrackQuality, load_axis: str) -> str:
    with style.styled():
        made = figure.draw_quality(track, found, load_axis)
        held = io.StringIO()
        made.savefig(held, format="svg", metadata={"Creator": "metacloak", "Date": None})
    text = held.getvalue()
    return re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)


def _lines(track: xr.Dataset, found: TrackQuality) -> Iterator[Line]:
    time = track["time"].values
    width, height = track["image_size"].values
    rate = (len(time) - 1) / (time[-1] - time[0]) if len(time) > 1 else float("nan")
    yield Line("Frames", f"{len(time)}", f"{rate:.4g} per second, {width} × {height} px")
    yield Line("Scale", f"{found.pixel:.4g} mm/px", f"{found.pitch:.3g} px from unit to unit")
    yield Line("Blur at edges", f"{found.blur:.2f} px", "standard deviation")
    yield Line("Stated uncertainty", *_accuracy(found.sigma, found.pixel))
    if np.isfinite(found.floor[0]):
        yield Line(
            f"Scatter in {found.resting} frames at rest", *_accuracy(found.floor, found.pixel)
        )
    else:
        yield Line("Scatter at rest", "not known", "no frames at rest in the beginning")
    yield Line("First frame less design", f"{found.residual:.3f} px", "of the specimen's own make")
    yield Line("Units lost", f"{100 * found.lost.sum(axis=1).mean():.3g} %", "of units and frames")
    for label, numbers in (("Repeated", found.duplicates), ("Dropped", found.dropped)):
        told = ", ".join(map(str, numbers[:12])) + (", …" if len(numbers) > 12 else "")
        yield Line(f"{label} frames", str(len(numbers)), told)
    own = f"{100 * found.stream.alone:.0f} % of the frames are held whole"
    rest = "" if found.stream.alone > 0.995 else ", the others as changes"
    yield Line("Codec", found.stream.codec, own + rest)


def _accuracy(of: np.ndarray, pixel: float) -> tuple[str, str]:
    place = float(np.hypot(*of[:2]) / np.sqrt(2))
    return f"{place:.3f} px, {of[2]:.3f} deg", f"{1000 * place * pixel:.2g} µm"
