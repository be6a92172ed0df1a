"""Draws a calibration: every set with its fit and residuals, then the constants."""

import argparse
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline import datasets
from pipeline.calibration.inputs import WRITTEN
from pipeline.datasets import SYNTHETIC_LABEL
from reports.base import style
from reports.page import Report, publish

COLUMNS = 4
_WIDE, _HIGH, _GAP, _LEFT = 33.0, 28.0, 44.0, 11.0
_REST = 11.0
_ROW = 62.0
_AXES = {
    "force_displacement": ("displacement, mm", "force, N", 1.0),
    "free_decay": ("time, s", "angle, deg", float(np.rad2deg(1.0))),
    "track": ("time, s", "displacement, mm", 1.0),
}
_COURSES = 5
"""Courses of a track that are drawn, those that move most."""
_WORDS = {
    "axial_stiffness": r"$k_\ell$",
    "shear_stiffness": r"$k_s$",
    "bending_stiffness": r"$k_\theta$",
    "damping_ratio": r"$\zeta$",
    "damping_translation": r"$c_u$",
    "damping_rotation": r"$c_\theta$",
    "contact_cutoff": r"$\phi_c$",
}


def report(args: argparse.Namespace) -> None:
    """Makes the figure that a command line asks for."""
    made = datasets.read(args.calibration, "calibration")
    publish(Report({"fit": lambda: draw_calibration(made)}), args.out_dir)


def draw_calibration(made: xr.Dataset) -> Figure:
    """Draws sets in rows of four with whitened residuals; then the constants' errors."""
    names = made["set"].values.tolist()
    rows = -(-len(names) // COLUMNS)
    drawn = style.page(rows * _ROW + 44.0)
    for number, name in enumerate(names):
        row, column = divmod(number, COLUMNS)
        left, top = _LEFT + column * _GAP, row * _ROW
        style.letter(drawn, left - 9.0, top + 1.0, style.numbered_letter(number), name.capitalize())
        _set(drawn, made, number, (left, top + 8.0))
    _constants(drawn, made, rows * _ROW)
    if made.attrs["synthetic"] == "yes":
        drawn.text(0.99, 0.005, SYNTHETIC_LABEL, ha="right", va="bottom", color=style.ALTERED)
    return drawn


def _set(drawn: Figure, made: xr.Dataset, number: int, corner: tuple[float, float]) -> None:
    chosen = _shown(made.isel(point=np.flatnonzero(made["set_of_point"].values == number)))
    along, label, factor = _AXES[str(made["kind"].values[number])]
    x = chosen["abscissa"].values
    axes = style.place(drawn, *corner, _WIDE, _HIGH)
    few = len(x) <= 100
    values, size = factor * chosen["measured"].values, 3.0 if few else 1.2
    dots: dict[str, Any] = {"color": style.GREY, "markeredgewidth": 0}
    axes.plot(x, values, ".", markersize=size, label="measured", **dots)
    fitted, width = factor * chosen["fitted"].values, 0.9 if few else 0.5
    for course in np.unique(channel := chosen["channel"].values):
        mine, name = channel == course, "fit" if course == channel[0] else None
        axes.plot(x[mine], fitted[mine], color=style.CLOAKED, linewidth=width, label=name)
    axes.set(ylabel=label, xticklabels=[])
    if number == 0:
        axes.legend(loc="upper left")
    below = style.place(drawn, corner[0], corner[1] + _HIGH + 3.0, _WIDE, _REST)
    below.axhspan(-2, 2, color=style.PALE, linewidth=0)
    rest = chosen["residual"].values
    below.plot(x, rest, ".", markersize=2.0 if few else 1.0, **dots)
    most = max(4.0, float(np.abs(rest).max()) * 1.05)
    below.set(xlabel=along, ylabel="residual/σ", ylim=(-most, most), xlim=axes.get_xlim())


def _shown(chosen: xr.Dataset) -> xr.Dataset:
    """Keeps of a track the displacements that go farthest; of other sets, all."""
    channel = chosen["channel"].values
    if not channel.any():
        return chosen
    places = np.unique(channel[channel % 3 < 2])
    reach = [np.ptp(chosen["fitted"].values[channel == course]) for course in places]
    farthest = places[np.argsort(reach)[-_COURSES:]]
    return chosen.isel(point=np.flatnonzero(np.isin(channel, farthest)))


def _constants(drawn: Figure, made: xr.Dataset, top: float) -> None:
    """Draws intervals relative to the values, and how much the errors go together."""
    names = [_WORDS[name] for name in made["parameter"].values]
    last = style.numbered_letter(made.sizes["set"])
    style.letter(drawn, 2.0, top, last, "Constants: 95 % intervals")
    axes = style.place(drawn, 14.0, top + 7.0, 78.0, 26.0)
    value = made["value"].values
    places = np.arange(len(names))
    for place, low, high, middle in zip(
        places, made["lower"].values, made["upper"].values, value, strict=True
    ):
        ends = 100 * (np.array([low, high]) / middle - 1)
        axes.plot(np.clip(ends, -100, 100), [place, place], color=style.CLOAKED, linewidth=2.0)
    axes.plot(0 * places, places, "o", color=style.CLOAKED, markersize=3)
    axes.axvline(0, color=style.GREY, linewidth=0.4)
    axes.set(xlabel="from the value, %", ylim=(len(names) - 0.4, -0.6))
    written = [WRITTEN[name] for name in made["parameter"].values]
    told = [
        f"{name} = {number * factor:.4g} {unit}".replace("^2", "²")
        for name, number, (unit, factor) in zip(names, value, written, strict=True)
    ]
    axes.set_yticks(places, names)
    for row, text in enumerate(told):
        axes.text(1.02, row, text, transform=axes.get_yaxis_transform(), va="center")
    _correlation(drawn, style.place(drawn, 138.0, top + 7.0, 26.0, 26.0), made, names)


def _correlation(drawn: Figure, axes: Axes, made: xr.Dataset, names: list[str]) -> None:
    shown = axes.imshow(made["correlation"].values, cmap=style.SIGNED, vmin=-1, vmax=1)
    axes.set_xticks(range(len(names)), names)
    axes.set_yticks(range(len(names)), names)
    axes.set_title("Correlation of errors")
    box = axes.get_position()
    bar = drawn.add_axes((box.x1 + 0.01, box.y0, 0.008, box.height))
    drawn.colorbar(shown, cax=bar)
