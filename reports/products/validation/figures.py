"""Draws samples with their fits and the prediction with its band; and load cycles with snaps."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.datasets.tables import TABLES
from reports.base import style
from sim.core import Floats

SYMBOLS = (r"$k_\ell$", r"$k_s$", r"$k_\theta$")
COLOURS = (style.ALTERED, "#1d7f78", style.CLOAKED, "#2f86b4", "#a33c00", "#5b6067")
_MOST = 8.0
"""Of the likelihood lost that is shown."""
LIMIT = 3.84
"""Of the same, at the ends of a 95 % interval."""


def draw_samples(made: xr.Dataset) -> Figure:
    """Draws the figure in two columns: fits above, prediction in the middle, causes below."""
    drawn = style.page(158.0)
    for k, test in enumerate(made["test"].values):
        left = 11.0 + 58.0 * k
        style.letter(drawn, left - 9.0, 1.0, "abc"[k], f"{str(test).capitalize()}, fitted")
        _fit(style.place(drawn, left, 8.0, 46.0, 34.0), made, str(test))
    style.letter(drawn, 2.0, 54.0, "d", "Another specimen, predicted")
    _prediction(style.place(drawn, 11.0, 61.0, 75.0, 42.0), made)
    style.letter(drawn, 93.0, 54.0, "e", "Predicted less measured")
    _residual(style.place(drawn, 104.0, 61.0, 70.0, 42.0), made)
    style.letter(drawn, 2.0, 115.0, "f", "Profile likelihood")
    _profile(style.place(drawn, 11.0, 122.0, 46.0, 27.0), made)
    style.letter(drawn, 63.0, 115.0, "g", "Residual explained by physics left out")
    _mechanisms(style.place(drawn, 120.0, 122.0, 54.0, 27.0), made)
    return drawn


def _fit(axes: Axes, made: xr.Dataset, test: str) -> None:
    curves, samples = made["curve"].values.astype(str), made["sample"].values.tolist()
    for curve in dict.fromkeys(name for name in curves if name.startswith(f"{test}_")):
        mine = curves == curve
        name = curve.removeprefix(f"{test}_")
        single = name in samples
        colour = COLOURS[samples.index(name) % len(COLOURS)] if single else style.INTACT
        label = f"sample {name}" if single else "mean"
        x, y = made["point_displacement"].values[mine], made["point_force"].values[mine]
        axes.plot(x, y, "o", color=colour, markersize=2.4, markeredgewidth=0, label=label)
    fitted = made.isel(test=made["test"].values.tolist().index(test))
    for k, force in enumerate(fitted["fit_force"].values):
        colour = COLOURS[k % len(COLOURS)]
        axes.plot(fitted["fit_displacement"], force, color=colour, linewidth=0.7)
    axes.set(xlabel="displacement, mm", ylabel="force, N", xlim=(0, None), ylim=(0, None))
    axes.legend(loc="upper left" if test != "compression" else "lower right")


def _prediction(axes: Axes, made: xr.Dataset) -> None:
    x = made["displacement"].values
    axes.fill_between(
        x, made["low"], made["high"], color=style.PALE, linewidth=0, label="95 % of new samples"
    )
    for end in ("student_low", "student_high"):
        label = "Student’s interval" if end == "student_low" else None
        axes.plot(x, made[end], ":", color=style.GREY, linewidth=0.8, label=label)
    axes.plot(x, made["median"], color=style.CLOAKED, label="median")
    if np.isfinite(made["simulated"]).any():
        axes.plot(x, made["simulated"], "--", color=style.ALTERED, label="simulated by the authors")
    axes.plot(x, made["measured"], "o", color=style.INTACT, markersize=2.2, label="measured")
    most = 1.45 * float(max(made["high"].max(), made["measured"].max()))  # room for the legend
    axes.set(xlabel="displacement, mm", ylabel="force, N", xlim=(0, None), ylim=(0, most))
    axes.legend(loc="upper left", ncols=2)


def _residual(axes: Axes, made: xr.Dataset) -> None:
    x, measured = made["displacement"].values, made["measured"].values
    for name, line, colour in (("median", "-", style.CLOAKED), ("simulated", "--", style.ALTERED)):
        axes.plot(x, 100 * (made[name].values / measured - 1), line, color=colour)
    axes.axhline(0, color=style.INTACT, linewidth=0.5)
    label = "% of the measured force"
    axes.set(xlabel="displacement, mm", ylabel=label, xlim=(0, None))


def _profile(axes: Axes, made: xr.Dataset) -> None:
    factor = made["factor"].values
    fine = np.geomspace(factor[0], factor[-1], 200)
    for k, symbol in enumerate(SYMBOLS):
        lost = np.maximum(made["profile"].values[k], 0.0)
        shown = np.interp(np.log(fine), np.log(factor), lost)
        axes.plot(fine, shown, color=COLOURS[k], label=symbol)
    axes.axhline(LIMIT, color=style.GREY, linewidth=0.5)
    axes.set(xlabel="factor on the median", ylabel="−2 ln L lost", xscale="log", ylim=(0, _MOST))
    axes.set_xticks([0.5, 1, 2, 4], ["0.5", "1", "2", "4"])
    axes.minorticks_off()
    axes.legend(loc="lower right")


def _mechanisms(axes: Axes, made: xr.Dataset) -> None:
    names = made["mechanism"].values.tolist()
    place = np.arange(len(names))
    colours = np.where(made["explained"].values > 0, style.CLOAKED, style.PALE)
    axes.barh(place, 100 * made["explained"].values, color=colours, height=0.7)
    axes.set_yticks(place, names)
    axes.axvline(0, color=style.INTACT, linewidth=0.5)
    axes.set(xlabel="% of the residual, at a plausible size", ylim=(len(names) - 0.4, -0.6))


_STYLES = {
    "closing": ("-", style.INTACT, "measured, nearing"),
    "opening": ("-", style.GREY, "measured, parting"),
    "equilibrium_closing": ("-", style.CLOAKED, "equilibria, nearing"),
    "equilibrium_opening": ("--", style.ALTERED, "equilibria, parting"),
    "equilibrium_traced": ((0, (2.0, 1.2)), style.INTACT, "equilibria, by arc length"),
}


def draw_cycles(made: xr.Dataset) -> Figure:
    """Draws one panel a record, two in a row."""
    count = made.sizes["record"]
    rows = -(-count // 2)
    drawn = style.page(58.0 * rows)
    for k in range(count):
        row, column = divmod(k, 2)
        left, top = 12.0 + 89.0 * column, 58.0 * row
        style.letter(
            drawn, left - 10.0, top + 1.0, style.numbered_letter(k), str(made["title"].values[k])
        )
        axes = style.place(drawn, left, top + 8.0, 72.0, 40.0)
        seen = _draw_paths(axes, made, k)
        snaps = made["record_of_snap"].values == k
        for end, force in (("snap_start", "snap_peak"), ("snap_end", "snap_rest")):
            named = "ends of a snap" if end == "snap_start" and snaps.any() else None
            x, y = made[end].values[snaps], made[force].values[snaps]
            axes.plot(x, y, "o", mfc="none", color=style.ALTERED, markersize=4, label=named)
        reach = 1.25 * np.abs(seen).max()
        axes.set(xlabel="approach of the clamps, mm", ylabel="tension, N", ylim=(-reach, reach))
        axes.axhline(0, color=style.GREY, linewidth=0.4)
        axes.legend(loc="best")
        _enlarge_trace(axes, made, k)
    return drawn


def _draw_paths(axes: Axes, made: xr.Dataset, record: int) -> Floats:
    """Draws force over displacement of a record and its equilibria; returns the measured force."""
    mine, role = made["record_of_point"].values == record, made["role"].values
    for name, number in TABLES["load_cycles"]["role"].flags.items():
        chosen = mine & (role == number)
        if chosen.any():
            line, colour, label = _STYLES[name]
            x, y = made["displacement"].values[chosen], made["force"].values[chosen]
            width = 0.5 if name == "equilibrium_traced" else 0.8
            axes.plot(x, y, linestyle=line, color=colour, linewidth=width, label=label)
            if number < 2:
                wide = np.nan_to_num(made["scatter"].values[chosen])
                axes.fill_between(x, y - wide, y + wide, color=style.PALE, linewidth=0)
    return np.asarray(made["force"].values[mine & (role < 2)])


def _enlarge_trace(axes: Axes, made: xr.Dataset, record: int) -> None:
    """Draws once more, enlarged, where the path is that a jump leaves, unstable in its midst."""
    traced = TABLES["load_cycles"]["role"].flags["equilibrium_traced"]
    on_it = (made["record_of_point"].values == record) & (made["role"].values == traced)
    if not on_it.any():
        return
    inset = axes.inset_axes((0.12, 0.7, 0.38, 0.3))
    _draw_paths(inset, made, record)
    for name, limit in (("displacement", inset.set_xlim), ("force", inset.set_ylim)):
        ends = made[name].values[on_it].min(), made[name].values[on_it].max()
        limit(1.5 * ends[0] - 0.5 * ends[1], 1.5 * ends[1] - 0.5 * ends[0])
    inset.tick_params(labelsize="small", length=1.5)
    axes.indicate_inset_zoom(inset, edgecolor=style.GREY)
