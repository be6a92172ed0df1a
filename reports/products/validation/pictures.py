"""Draws parts tracked in real pictures beside another program's result, and a located specimen."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from pipeline.calibration import numbered_pictures
from pipeline.calibration.inputs import KnownPictures
from pipeline.runtime import UserError
from pipeline.tracking.frames import read_picture
from pipeline.tracking.motion import transform_outline
from reports.base import style
from reports.page import PageTable
from sim.core import Floats, Image

_SHOWN = 3
"""Of the later pictures, evenly spaced."""
_ABOUT = 60
"""Distance of a picture's rim from the outlines, px."""
_UNITS = ("px", "px", "mrad")


def tracking_error(made: xr.Dataset) -> Floats:
    """Computes root mean squares (n_parts, 3) of this tracker less the other: px, px, rad.

    They are over the pictures in which both have found a part; NaN where there is none.
    """
    apart = (made["measured"] - made["reference"]).transpose("part", "frame", "dof")
    return np.asarray(np.sqrt((apart**2).mean("frame")))


def error_table(made: xr.Dataset) -> PageTable:
    """Tabulates the differences of both trackers by part."""
    rows = []
    for part, error in zip(made["part"].values.tolist(), tracking_error(made), strict=True):
        motion = made["reference"].sel(part=part)
        shift = float(np.hypot(motion.sel(dof="ux"), motion.sel(dof="uy")).max())
        turn = float(np.abs(motion.sel(dof="theta")).max())
        told = [f"{shift:.1f} px, {turn:.2f} rad", *(f"{each:.3f}" for each in error[:2])]
        rows.append([part, *told, f"{error[2]:.4f}"])
        if np.isnan(error).any():
            rows[-1] = [part, "in no picture of both", "", "", ""]
    heads = ["Part", "Moves by up to", "rms to the right, px", "rms down, px", "rms rotation, rad"]
    return PageTable(heads, rows)


def draw_pictures(made: xr.Dataset, asked: KnownPictures, folder: Path) -> Figure:
    """Draws the parts in some pictures, the differences of the trackers, and the specimen."""
    drawn = style.page(208.0)
    parts = asked.rigid_parts
    outlines = [np.array(each.outline) for each in parts.parts]
    at = np.linspace(0, made.sizes["frame"] - 1, _SHOWN).round().astype(int)
    shown = pictures_of_frames(folder / parts.folder, made["frame"].values[at].tolist())
    points = np.concatenate(outlines)
    reach = points.min(axis=0) - _ABOUT, points.max(axis=0) + _ABOUT
    style.letter(drawn, 2.0, 1.0, "a", "At rest, and tracked")
    for k, path in enumerate([folder / parts.folder / parts.first, *shown]):
        axes = style.place(drawn, 2.0 + 43.5 * k, 8.0, 42.0, 60.0)
        _show(axes, read_picture(path), reach)
        for part, outline in enumerate(outlines):
            motion = np.zeros(3) if k == 0 else made["measured"].values[part, at[k - 1]]
            centre = np.array(parts.parts[part].centre)
            corners = transform_outline(outline, centre, motion)
            for colour, width in (("white", 2.0), (style.INTACT if k == 0 else style.CLOAKED, 1.0)):
                axes.fill(*corners.T, facecolor="none", edgecolor=colour, linewidth=width)
    for k, name in enumerate(("to the right", "down", "rotation")):
        style.letter(drawn, 2.0 + 60.0 * k, 74.0, "bcd"[k], f"Less {parts.program}’s, {name}")
        place = style.place(drawn, 11.0 + 60.0 * k, 81.0, 44.0, 26.0)
        _difference(place, made, k, parts.bounds)
    style.letter(drawn, 2.0, 118.0, "e", "A specimen at rest, located")
    axes = style.place(drawn, 28.0, 124.0, 124.0, 80.0)
    _specimen(axes, made, read_picture(folder / asked.specimen.file))
    return drawn


def pictures_of_frames(folder: Path, frames: Sequence[int]) -> list[Path]:
    """Finds the pictures of frames by their numbers."""
    pictures = numbered_pictures(folder)
    for frame in frames:
        if frame not in pictures:
            remedy = "give the folder whose pictures were studied"
            raise UserError("no picture of a frame", file=folder, value=frame, remedy=remedy)
    return [pictures[frame] for frame in frames]


def _show(axes: Axes, image: Image, reach: tuple[Floats, Floats]) -> None:
    (left, top), (right, bottom) = (np.clip(end, 0, image.shape[::-1]).astype(int) for end in reach)
    cut = image[top:bottom, left:right]
    extent = (left - 0.5, right - 0.5, bottom - 0.5, top - 0.5)
    axes.imshow(cut, cmap="gray", vmin=0, vmax=np.percentile(cut, 99.5), extent=extent)
    axes.set_axis_off()


def _difference(
    axes: Axes, made: xr.Dataset, dof: int, bounds: tuple[float, float, float] | None
) -> None:
    scale = 1000.0 if dof == 2 else 1.0
    apart = scale * (made["measured"] - made["reference"]).values[:, :, dof]
    for part, name in enumerate(made["part"].values.tolist()):
        colour = (style.CLOAKED, "#1d7f78", style.INTACT)[part % 3]
        axes.plot(made["frame"], apart[part], "o-", color=colour, markersize=2.5, label=name)
    axes.set(xlabel="number of the picture", ylabel=_UNITS[dof])
    axes.margins(y=0.4)  # room for the legend
    if bounds is not None:
        limit = scale * bounds[dof]
        for end in (-limit, limit):
            axes.axhline(end, color=style.GREY, linestyle=":", linewidth=0.8)
        axes.set_ylim(-3 * limit, 3 * limit)
    if dof == 0:
        axes.legend(loc="upper left", ncols=2)


def _specimen(axes: Axes, made: xr.Dataset, image: Image) -> None:
    rows, columns = image.shape
    axes.imshow(image, cmap="gray", vmin=0, vmax=255)
    found = made["seen"].values > 0
    for chosen, colour in ((found, style.CLOAKED), (~found, style.ALTERED)):
        outlines = PolyCollection(
            list(made["outline"].values[chosen]),
            facecolors="none",
            edgecolors=colour,
            linewidths=0.8,
        )
        axes.add_collection(outlines)
    axes.plot(*made["blob"].values[found].T, ".", color=style.CLOAKED, markersize=1.5)
    axes.set(xlim=(-0.5, columns - 0.5), ylim=(rows - 0.5, -0.5))
    axes.set_axis_off()


def picture_facts(made: xr.Dataset, asked: KnownPictures) -> Mapping[str, Any]:
    """Tells which parts and units were found, how large a pixel is, and how trackers agree."""
    stated, found = asked.specimen.pixel_size, made["pixel_size"].item()
    missed = made["reference"].notnull() & made["measured"].isnull()
    parts, error = asked.rigid_parts, tracking_error(made)
    limits = np.inf if parts.bounds is None else parts.bounds
    return {
        "units": made.sizes["unit"],
        "found": int(made["seen"].sum()),
        "pixel_size": f"{found:.3f} mm",
        "stated": f"{stated:.3f} mm",
        "pictures": made.sizes["frame"],
        "missed_parts": int(missed.any("dof").sum()),
        "program": parts.program,
        "accuracy": parts.accuracy,
        "judged": parts.bounds is not None and bool(np.isfinite(error).any()),
        "within": not (error > limits).any(),
        "doc": asked.doc,
    }
