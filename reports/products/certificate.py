"""Draws the losses of designs over a family of loads: distribution, map and table."""

import argparse

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline import datasets, problem
from reports.base import Table, prose, style
from reports.page import FigureText, PageTable, figure_page, publish, titled
from reports.study import study_results

_PROSE = prose(__file__)
_COLUMNS = (
    "design", "mean", "95 % of the loads", "worst of the loads", "worst found by a search",
    "worst of the loads over mean", "drive's own loads, mean", "drive's own loads, worst",
)  # fmt: skip
_COLOURS = {"cloaked": style.CLOAKED, "study": style.GREY}
_NAMES = {"cloaked": "this design", "study": "the study's own design"}
_TOP, _HIGH = 13.0, 55.0
_NEAR = 0.95
"""Of the greatest loss that a search ended at: those above it found the same worst."""


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    whole = problem.load(args.problem)
    asked = problem.load(args.problem, args.preset) if args.preset else whole
    data = datasets.read(args.certificate, "certificate")
    study_results.check_problem(asked, "certify", data, args.certificate)
    own = data.sel(design="cloaked")
    lead = _PROSE["lead"].format(
        loads=data.sizes["load"],
        searches=data.sizes["search"],
        worst=_worst(own),
        at=_worst_load(own),
        mean=float(own["loss"].mean()),
    )
    over = _PROSE["over"]["motion" if _harmonic(data) else "path"]
    near = int((own["found_loss"] > _NEAR * own["found_loss"].max()).sum())
    caption = _PROSE["caption"].format(over=over, near=near, searches=data.sizes["search"])
    text = FigureText(titled(asked, args.problem), _PROSE["subject"], lead, caption)
    shown = PageTable(_COLUMNS, [_row(data.sel(design=name)) for name in data["design"].values])
    made = figure_page(
        "certificate", text, lambda: draw_certificate(data), _tables(data), data, shown=shown
    )
    publish(made, args.out_dir)


def _worst(of: xr.Dataset) -> float:
    """The greatest loss of a design, of all that was tried."""
    return max(float(of["loss"].max()), float(of["found_loss"].max()))


def _worst_load(of: xr.Dataset) -> str:
    """Names the load of the greatest loss of a design, of all that were tried."""
    kind, loss = max(
        (("load", "loss"), ("found", "found_loss")), key=lambda k: float(of[k[1]].max())
    )
    worst = int(np.nanargmax(of[loss].values))
    units = {"direction": "°", "amplitude": " mm"} | ({"frequency": " Hz"} if _harmonic(of) else {})
    told = (f"{float(of[f'{kind}_{part}'][worst]):.3g}{unit}" for part, unit in units.items())
    return ", ".join(told)


def _row(of: xr.Dataset) -> tuple[str, ...]:
    mean = float(of["loss"].mean())
    values = (
        mean,
        float(of["loss"].quantile(0.95)),
        float(of["loss"].max()),
        float(of["found_loss"].max()),
        float(of["loss"].max()) / mean,
        float(of["nominal_loss"]),
        float(of["nominal_worst"]),
    )
    return _NAMES[str(of["design"].item())], *(f"{value:.4g}" for value in values)


def _tables(data: xr.Dataset) -> list[Table]:
    def columns(name: str, loss: str) -> dict[str, np.ndarray]:
        """Loads of one kind, a row for each design and load."""
        parts = [f"{name}_direction", f"{name}_amplitude", f"{name}_frequency", loss]
        rows = data[["design", *parts]].to_dataframe().reset_index()
        return {"design": rows["design"].to_numpy()} | {
            f"{part} ({data[part].attrs.get('units', '1')})": rows[part].to_numpy()
            for part in parts
        }

    return [
        Table("certificate.csv", "losses under random loads", columns("load", "loss")),
        Table("searches.csv", "loads that searches ended at", columns("found", "found_loss")),
    ]


def _harmonic(data: xr.Dataset) -> bool:
    return bool(data["load_frequency"].notnull().all())


def draw_certificate(data: xr.Dataset) -> Figure:
    """Draws the figure at two-column width."""
    figure = style.page(_TOP + _HIGH + 11.0)
    style.letter(figure, 1.0, 1.0, "a", "Loss under random loads")
    style.letter(figure, 88.0, 1.0, "b", "Loss of the design, load by load")
    _distribution(style.place(figure, 13.0, _TOP, 66.0, _HIGH), data)
    _map(figure, style.place(figure, 100.0, _TOP, 58.0, _HIGH), data)
    return figure


def _label(data: xr.Dataset) -> str:
    unit = data["loss"].attrs.get("units", "1")
    return "loss" if unit == "1" else f"loss ({unit})"


def _distribution(axes: Axes, data: xr.Dataset) -> None:
    for name in data["design"].values[::-1]:
        of, colour = data.sel(design=name), _COLOURS[str(name)]
        ordered = np.sort(of["loss"].values[~np.isnan(of["loss"].values)])
        share = 100 * (1 - np.arange(1, len(ordered) + 1) / len(ordered))
        axes.plot(ordered, share, color=colour, label=_NAMES[str(name)])
        axes.plot(
            of["found_loss"], np.full(data.sizes["search"], 104.0 if name == "cloaked" else 108.0),
            "|", color=colour, markersize=4.0, clip_on=False,
        )  # fmt: skip
        axes.plot(of["nominal_worst"], 0.0, "v", color=colour, markersize=4.0, clip_on=False)
    axes.set(xlabel=_label(data), ylabel="share of the loads above (%)", ylim=(0.0, 100.0))
    axes.set_xlim(left=0.0)
    axes.legend(loc="upper right")


def _map(figure: Figure, axes: Axes, data: xr.Dataset) -> None:
    """Draws losses over frequency and amplitude, or over direction and amplitude of a path."""
    own = data.sel(design="cloaked")
    across = "frequency" if _harmonic(data) else "direction"
    order = np.argsort(own["loss"].values)
    largest = _worst(own)
    drawn = axes.scatter(
        own[f"load_{across}"][order], own["load_amplitude"][order], c=own["loss"][order],
        cmap=style.MAGNITUDE, vmin=0.0, vmax=largest, s=7.0, linewidths=0.0,
    )  # fmt: skip
    axes.scatter(
        own[f"found_{across}"], own["found_amplitude"], s=16.0, facecolors="none",
        edgecolors=style.CLOAKED, linewidths=0.7, clip_on=False,
    )  # fmt: skip
    if across == "frequency":
        axes.set(xscale="log", xlabel="frequency (Hz)")
        low, high = np.round(np.log2(axes.get_xlim())).astype(int)
        axes.set_xticks(octaves := 2.0 ** np.arange(low, high + 1), [f"{f:g}" for f in octaves])
        axes.minorticks_off()
    else:
        axes.set(xlabel="direction (°)")
    axes.set(ylabel="amplitude (mm)")
    bar = figure.colorbar(drawn, cax=style.place(figure, 161.0, _TOP, 2.5, _HIGH))
    bar.set_label(_label(data))
