"""Draws curves along the path: the measure, contraction, reaction, imperfect copies."""

from collections.abc import Collection, Iterable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, MaxNLocator

from pipeline.problem import Problem
from reports.base import style
from reports.facts import JUMPED, copies
from reports.figures.loading_path import measured, measures, monte_carlo
from reports.figures.loading_path.abscissa import (
    SECOND,
    Abscissa,
    abscissa_of,
    load_names,
    structures,
)
from reports.figures.loading_path.drive_response import drive_response
from reports.figures.loading_path.load_legend import curve_style
from reports.figures.loading_path.measures import Measure, over_cases
from reports.panels import measured_overlay
from reports.study import RedesignResults, StudyResults, display_name

BAND = (5.0, 95.0)
"""Percentiles of the imperfect copies that a band spans."""
RIGHT_AXIS = 9.0
"""Room for the labels of an axis on the right, mm."""

_FLAT = 0.05
"""Share of the altered structure's measure below which a curve is seen on a logarithmic axis."""
_BELOW = 0.1
"""Share of the upper limit of an axis by which the lower one is under zero if curves are."""
_BESIDE_TITLE = (22.0, 25.4)  # points from the upper right corner, over a paper's label
_LINE, _MOST_ROOM = 0.1, 0.6  # of a panel's height: a line of its legend, and all lines at most


def path_axes(axes: Axes, path: Abscissa, label: str) -> None:
    """Draws an x axis along the path, with a paper's label of the load above it if there is one."""
    axes.set(xlabel=path.label, ylabel=label, xlim=(path.values[0], path.values[-1]))
    axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 3, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    if path.strain is None:
        return
    ratio = 100.0 * path.strain / float(path.values[-1])
    above = axes.secondary_xaxis(
        "top", functions=(lambda x: np.multiply(x, ratio), lambda x: np.divide(x, ratio))
    )
    above.set_xlabel("Paper’s label ε (%)", labelpad=2.5, fontsize=style.SMALL)
    above.xaxis.set_major_locator(FixedLocator(list(ratio * path.values[list(path.shown)])))
    above.xaxis.set_major_formatter(lambda value, _: f"{abs(value):.2g}")  # no strain is negative


def structure_curves(
    axes: Axes, problem: Problem, path: Abscissa, values: xr.DataArray, names: Iterable[str]
) -> None:
    """Draws values (structure, case, time) of some structures, a curve for each load case.

    Of several cases each has its dashes and its tint of the structure's colour.
    """
    loads = load_names(problem, values)
    for name in names:
        order, title = 3 if name == "intact" else 4, display_name(problem, name)
        for number, load in enumerate(loads):
            label = title if len(loads) == 1 else f"{title}, {load}"
            curve = values.sel(structure=name).isel(case=number)
            line = curve_style(name, number)
            axes.plot(path.values, curve, label=label, zorder=order, **line)


def measure_panel(
    axes: Axes,
    study: StudyResults,
    path: Abscissa,
    measure: Measure,
    named: Collection[Line2D] = (),
) -> None:
    """Tells what the cloak should keep small, with the bands of the cloak's imperfect copies.

    What is `named` in a legend outside of the panel is not in the panel's own.
    """
    problem, response = study.problem, study.response
    path_axes(axes, path, measure.symbol)
    names = [name for name in structures(response) if name != "intact"]
    values = measure.of(response)
    structure_curves(axes, problem, path, values, names)
    _jumps(axes, path, values, response)
    if study.redesign is not None and study.redesign.changed:
        _second(axes, study, measure, study.redesign)
    vanishes = _vanishes(problem, values)
    if not vanishes:
        still = (
            "Unloaded" if problem.objective.target == "rest" else display_name(problem, "intact")
        )
        axes.plot(path.values[[0, -1]], [0, 0], color=style.INTACT, lw=1.2, label=f"{still}: zero")
    if (copied := banded_copies(study)) is not None:
        _bands(axes, study, path, measure, copied)
    measured.bands(axes, study, measure.key, names)
    measured.measured_curves(axes, study, path, measure.of, names)
    outside = {entry.get_label() for entry in named}
    drawn = zip(*axes.get_legend_handles_labels(), strict=True)
    own = [handle for handle, label in drawn if label not in outside]
    legend = axes.legend(handles=own, loc="upper left", handlelength=1.2)
    room = min(_LINE * len(legend.get_texts()), _MOST_ROOM)
    if vanishes:
        seen = values.sel(structure=names).isel(time=slice(1, None)).values
        low, high = 0.5 * float(np.nanmin(seen[seen > 0.0])), 1.1 * float(np.nanmax(seen))
        style.log_values(axes)
        axes.set_ylim(low, high * (high / low) ** (room / (1.0 - room)))
    else:
        # a path rises from the left, below the legend; a motion in time swings below all of it
        above = 1.1 + room if path.static else 1.05 / (1.0 - 1.2 * room)
        axes.set_ylim(0, above * axes.get_ylim()[1])


def banded_copies(study: StudyResults) -> xr.Dataset | None:
    """Returns imperfect copies of which bands are drawn: none where prediction bands are."""
    key = measures.measure_of(study.problem).key
    return None if measured.has_bands(study, key) else study.scatter


def _vanishes(problem: Problem, values: xr.DataArray) -> bool:
    """Tests if the cloak's curve lies on the axis where the altered structure's is seen."""
    ends = over_cases(problem, values).isel(time=-1)
    return float(ends.sel(structure="cloaked")) < _FLAT * float(ends.sel(structure="altered"))


def _second(axes: Axes, study: StudyResults, measure: Measure, again: RedesignResults) -> None:
    """Draws the design for contact on distance."""
    way = abscissa_of(study.problem, again.response)
    values = over_cases(study.problem, measure.of(again.response)).sel(structure="cloaked")
    dashes = (0, (3.0, 1.5))
    axes.plot(way.values, values, color=style.CLOAKED, lw=1.0, ls=dashes, label=SECOND)


def _jumps(axes: Axes, path: Abscissa, values: xr.DataArray, response: xr.Dataset) -> None:
    """Draws crosses where a structure came to another branch of equilibria."""
    jumped = response["stability"] >= JUMPED
    for name in structures(response):
        colour = style.STRUCTURE_COLOURS[name]
        for case in range(response.sizes["case"]):
            at = jumped.sel(structure=name).isel(case=case).values
            curve = values.sel(structure=name).isel(case=case).values
            axes.plot(path.values[at], curve[at], "x", color=colour, ms=4)


def _bands(
    axes: Axes, study: StudyResults, path: Abscissa, measure: Measure, made: xr.Dataset
) -> None:
    """Draws the 5 % to 95 % percentiles of every kind of noise, laid over one another."""
    made = made.sel(noise=monte_carlo.drawn_noises(made))
    along = np.interp([0.0, *made["time"].values], study.response["time"], path.values)
    values = monte_carlo.copy_curves(study.problem, measure, study.response, made)
    for noise in made["noise"].values:
        low, high = np.nanpercentile(values.sel(noise=noise), BAND, axis=0)
        low, high = np.insert(low, 0, 0.0), np.insert(high, 0, 0.0)  # all start from rest
        axes.fill_between(along, low, high, color=style.CLOAKED, alpha=0.18, lw=0, zorder=2)


def robustness_panel(axes: Axes, study: StudyResults, measure: Measure, made: xr.Dataset) -> None:
    """Draws the measure of path or motion: median and percentiles of kinds of noise."""
    made = made.sel(noise=monte_carlo.drawn_noises(made))
    ends = measures.overall(study.problem, over_cases(study.problem, measure.of(study.response)))
    values = monte_carlo.copy_curves(study.problem, measure, study.response, made)
    found = copies.spreads(measures.overall(study.problem, values), made)
    for row, spread in enumerate(found):
        axes.plot([spread.low, spread.high], [row, row], color=style.CLOAKED, lw=3.0, alpha=0.45)
        axes.plot(spread.middle, row, "o", ms=3.6, mfc="white", mec=style.CLOAKED, mew=1.0)
    for name, dashes in (("altered", (4.0, 2.0)), ("cloaked", (1.5, 1.5))):
        colour, end = style.STRUCTURE_COLOURS[name], float(ends.sel(structure=name))
        axes.axvline(end, color=colour, lw=0.9, ls=(0, dashes), zorder=1)
    names = [each.noise.replace(" ", "\n", 1).replace(", ", ",\n") for each in found]
    axes.set_yticks(range(len(found)), names)
    axes.set(ylim=(len(found) - 0.5, -0.5), xlim=(0, None), xlabel=measure.symbol)
    axes.xaxis.set_major_locator(MaxNLocator(4))


def contraction_panel(axes: Axes, study: StudyResults, path: Abscissa) -> None:
    """Tells how much nearer top and bottom rows come."""

    def of(response: xr.Dataset) -> xr.DataArray:
        return measures.contraction(study.problem, response)

    _plain_panel(axes, study.problem, path, of(study.response), "Contraction (mm)")
    names = structures(study.response)
    measured.bands(axes, study, "contraction", names)
    measured.measured_curves(axes, study, path, of, names)
    _sides(axes, study)


def drive_panel(axes: Axes, study: StudyResults, path: Abscissa) -> None:
    """Draws what the drive's units answer with, and the force of a load cell where there is one."""
    response, problem = drive_response(study.problem), study.problem
    values = response.of(study.response)
    _plain_panel(axes, problem, path, values, response.axis)
    if response.held and "intact" in structures(study.response) and path.static:
        off = over_cases(problem, measures.reaction_error(values)).sel(structure="cloaked")
        axes.annotate(
            f"cloaked: RMS {100 * float(off):.1f} %", (1.0, 1.0), _BESIDE_TITLE,
            xycoords="axes fraction", textcoords="offset points", color=style.CLOAKED,
            fontsize=style.SMALL, ha="right",
        )  # fmt: skip
    if path.static and response.key == "reaction":
        _traced(axes, study, path)
    measured.forces(axes, study)
    if problem.objective.target == "rest":  # or another panel has told it
        _sides(axes, study)
    if path.static:
        _eigenvalues(axes, study, path)


def _traced(axes: Axes, study: StudyResults, path: Abscissa) -> None:
    """Draws the paths that snaps leave, dashed, and a line at the load of each snap."""
    response = study.response
    angles = np.radians(response["direction"].values)
    for name in structures(response):
        part, colour = response.sel(structure=name), style.STRUCTURE_COLOURS[name]
        for case, angle in enumerate(angles):
            load, force = (
                part[key].isel(case=case).values for key in ("traced_load", "traced_force")
            )
            along = force @ [np.cos(angle), np.sin(angle)]
            way = np.interp(load, part["time"].values, path.values, right=np.nan)
            axes.plot(way, along, color=colour, lw=0.8, ls=(0, (2.0, 1.2)), zorder=3)
        for place in np.interp(part["snap_load"].values.ravel(), part["time"].values, path.values):
            if np.isfinite(place):
                axes.axvline(place, color=colour, lw=0.6, ls=(0, (1.0, 2.0)), zorder=2)


def _eigenvalues(axes: Axes, study: StudyResults, path: Abscissa) -> None:
    """Draws the smallest eigenvalue of the tangent, dotted, against an axis on the right.

    Of several load cases it is the least: their mean would not vanish where one of them snaps.
    Both axes have their zero at the same height, in the lower half.
    """
    box, margin = axes.get_position(), RIGHT_AXIS / style.TWO_COLUMNS
    axes.set_position((box.x0, box.y0, box.width - margin, box.height))
    right, least = axes.twinx(), 1e3 * study.response["eigenvalue"].min("case")
    for name in structures(study.response):
        colour = style.STRUCTURE_COLOURS[name]
        right.plot(path.values, least.sel(structure=name), color=colour, lw=1.0, ls=":")
    # below the legend that tells measured curves from simulated ones
    room = 1.5 if study.recordings and study.problem.objective.target == "rest" else 1.05
    low, high = axes.get_ylim()
    high = axes.set_ylim(low, max(high, -low))[1]
    top = room * max(0.0, float(least.max())) or 1.0
    right.set(ylim=(low / high * top, top), ylabel="Eigenvalue (N/m)")
    right.yaxis.set_major_locator(MaxNLocator(4))


def _sides(axes: Axes, study: StudyResults) -> None:
    """Tells which curves are measured, and which simulated."""
    if study.recordings:
        told = measured_overlay.handles(study.recordings)
        axes.legend(handles=told, loc="upper left", handlelength=1.6)
        low, high = axes.get_ylim()
        # curves that rise from zero begin below the legend, others need room below all of it
        room = 0.13 * high if low > -_BELOW * high else 0.21 * (high - low)
        axes.set_ylim(None, high + len(told) * room)


def _plain_panel(
    axes: Axes, problem: Problem, path: Abscissa, values: xr.DataArray, label: str
) -> None:
    path_axes(axes, path, label)
    names = structures(values.to_dataset(name="values"))
    structure_curves(axes, problem, path, values, names)
    axes.axhline(0.0, color=style.PALE, lw=0.5, zorder=1)
