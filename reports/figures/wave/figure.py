"""Composes the figure of structures that waves run through: its panels and their tables."""

from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.base import Table, prose, scale_wide_numbers, style
from reports.facts import Columns, headed_columns
from reports.figures.loading_path import (
    LoadLegend,
    SnapshotLayout,
    SnapshotStructure,
    abscissa_of,
    arrows_in_words,
    by_structure,
    design_panels,
    marks,
    measure_panel,
    measures,
    path_axes,
    snapshots,
    structure_curves,
    structures,
)
from reports.figures.wave import contacts, edge_contacts
from reports.figures.wave.monitored_places import MonitoredUnit, first_structure, places
from reports.panels import Panel, PanelFigure, measured_overlay
from reports.study import StudyResults

CONTACT = "#e3342f"
"""Colour of marks: of contacts, and of places, as in the paper."""
ROOM = 8.5
"""Between the letter of a row and its panels, mm."""
TALLEST_SNAPSHOTS = 82.0
"""Height that all snapshots may take on a page that has two rows of curves, mm."""
_PROSE = prose(__file__)


def wave_figure(study: StudyResults) -> PanelFigure:
    """Returns the whole figure."""
    path, half = abscissa_of(study.problem, study.response), style.TWO_COLUMNS / 2
    legend = LoadLegend.of(study)
    grid = SnapshotLayout.of(study, path, TALLEST_SNAPSHOTS - legend.height)
    top = 52.0
    middle = top + grid.head + grid.total + 1.5
    first = middle + ROOM + legend.height
    low = middle + 44.0 + legend.height

    def error(figure: Figure) -> None:
        axes = style.place(figure, 11.0, low + ROOM, half - 14.0, 27.0)
        measure_panel(axes, study, path, measures.measure_of(study.problem), legend.entries)
        scale_wide_numbers(axes)

    def motions(figure: Figure) -> None:
        legend.draw(figure, middle + ROOM - 1.5)
        _places(figure, study, first, named=not legend.entries)

    panels = [
        *design_panels(
            study, _PROSE["a"].format(turns=arrows_in_words(study)), partial(_mark_places, study)
        ),
        Panel(
            ("c", "Response, true to scale; red dots: contacts", 0.0, top),
            lambda figure: snapshots(
                figure, study, grid, top + grid.head, partial(_contacts, study)
            ),
            _PROSE["c"],
        ),
        Panel(
            ("d", "Vertical displacement where marked in a", 0.0, middle),
            motions,
            _PROSE["d"],
            [Table("waves.csv", "every structure over time (panels d to f)", _over_time(study))],
        ),
        Panel(("e", "Mimicking error", 0.0, low), error, _PROSE["e"].format(marks=marks([study]))),
        Panel(
            ("f", contacts.contact_measure(study.problem).title, half, low),
            lambda figure: _edges(
                style.place(figure, half + 11.0, low + ROOM, half - 14.0, 27.0), study
            ),
            _PROSE["f"],
            _steps(study.verification),
        ),
    ]
    remark = measured_overlay.caption(study.recordings, grid.recorded) + grid.omission(path)
    return PanelFigure(low + 46.0, panels, study.draft, remark)


def _mark_places(study: StudyResults, axes: Axes) -> None:
    sites = first_structure(study.problem, study.response).site
    for place in places(study.problem, study.response):
        x, y = sites[place.unit]
        axes.plot(x, y, clip_on=False, zorder=9, **_mark(place, 3.6))


def _mark(place: MonitoredUnit, size: float) -> dict[str, Any]:
    """Returns arguments of a plot of the place's mark, `size` points wide; stars are larger."""
    width = 6.0 if isinstance(place.mark, tuple) else size
    return {"ls": "", "marker": place.mark, "ms": width, "mfc": CONTACT, "mec": "white", "mew": 0.5}


def _contacts(study: StudyResults, axes: Axes, row: SnapshotStructure, sample: int) -> None:
    """Draws dots where the structure is in contact."""
    part = row.part.isel(case=row.case)
    x, y = contacts.contact_places(study.problem, part, sample).T
    axes.plot(x, y, ls="", marker="o", ms=2.4, mfc=CONTACT, mec="white", mew=0.3, zorder=8)


def _places(figure: Figure, study: StudyResults, top: float, *, named: bool) -> None:
    """Draws u_y over time at each place, side by side; curves are `named` in the first panel."""
    shown = places(study.problem, study.response)
    path = abscissa_of(study.problem, study.response)
    rise = study.response["displacement"].sel(dof="uy")
    width = style.TWO_COLUMNS / max(len(shown), 1)
    for k, place in enumerate(shown):
        axes = style.place(figure, k * width + 11.0, top, width - 14.0, 25.0)
        path_axes(axes, path, "$u_y$ (mm)" if k == 0 else "")
        curves = rise.isel(unit=place.unit)
        structure_curves(axes, study.problem, path, curves, structures(study.response))
        reach = 1.25 * float(np.abs(curves).max())
        axes.set_ylim(-reach, reach)
        axes.plot(0.05, 0.9, transform=axes.transAxes, **_mark(place, 4.0))
        scale_wide_numbers(axes)
        if k == 0 and named:
            axes.legend(loc="lower left", handlelength=1.2, borderaxespad=0.2)


def _edges(axes: Axes, study: StudyResults) -> None:
    """Draws how near neighbours on the edges are over time, and when that is contact."""
    path = abscissa_of(study.problem, study.response)
    measure = contacts.contact_measure(study.problem)
    path_axes(axes, path, measure.axis)
    nearest = edge_contacts.along_edges(study.problem, study.response, measure).min("ligament")
    values = measure.shown * nearest
    structure_curves(axes, study.problem, path, values, structures(study.response))
    begins, end = measure.shown * measure.begins, measure.shown * measure.end
    axes.axhspan(end, begins, color=CONTACT, alpha=0.18, lw=0, zorder=1)
    top = 1.1 * float(values.max())
    axes.set_ylim(end - 0.07 * (top - end), top)
    axes.text(
        0.01, end + 0.5 * (begins - end), "contact", color=CONTACT, fontsize=style.SMALL,
        va="center", transform=axes.get_yaxis_transform(),
    )  # fmt: skip
    scale_wide_numbers(axes)


def _over_time(study: StudyResults) -> Columns:
    """Returns one row a sample: u_y where marked, mimicking error, edges, energies."""
    problem, response = study.problem, study.response
    rise = response["displacement"].sel(dof="uy")
    measure = contacts.contact_measure(problem)
    edges = edge_contacts.along_edges(problem, response, measure)
    series = {
        f"uy_{k + 1}_mm": rise.isel(unit=place.unit)
        for k, place in enumerate(places(problem, response))
    }
    series |= {
        "mimicking_error": measures.measure_of(problem).of(response),
        measure.column: edges.min("ligament"),
        "strain_energy_Nmm": response["strain_energy"],
        "contact_energy_Nmm": response["contact_energy"],
        "min_void_angle_rad": response["min_void_angle"],
    }
    return {"time_s": response["time"].values} | by_structure(study, series)


def _steps(verification: xr.Dataset | None) -> list[Table]:
    if verification is None:
        return []
    checks, names = verification["check"].values, verification["structure"].values
    check, structure = np.meshgrid(checks, names, indexing="ij")
    columns: Columns = {"check": check.ravel(), "structure": structure.ravel()}
    told = ("time_step", "loss", "error", "departure", "min_void_angle", "gap", "overlaps")
    columns |= headed_columns(verification, *told)
    return [Table("steps.csv", "loss and error with shorter steps", columns)]
