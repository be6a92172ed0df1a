"""Composes Figure 1 at two-column width: problem, model, optimisation, making, comparing."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch
from matplotlib.ticker import LogLocator, NullFormatter

from reports.base import prose, scale_wide_numbers, style
from reports.facts import measures
from reports.figures.framework import domain_panels, model_panel
from reports.figures.shielding import MONITORED, monitored, monitored_recordings
from reports.panels import CLAMP_TINT, CLOAK_TINT, Panel, PanelFigure, measured_overlay
from reports.study import CLOAK, RigidUnits, StudyResults, from_dataset, middle_of_top_edge

HEIGHT = 158.0
SIDE = 43.0
"""Side of a domain in row a, mm."""
SECOND, THIRD = 61.0, 109.0
"""Tops of rows b and c, mm."""
SMALL, LOOP = 34.0, 112.0
"""Side of a picture in rows b and c, and where the loop of row a begins, mm."""
_PROSE = prose(__file__)


def framework_figure(study: StudyResults) -> PanelFigure:
    """Returns the whole figure."""
    scene, design = study.scene, study.design
    initial = from_dataset(design, scene.spacing, "vertices_initial")
    cloaked = from_dataset(design, scene.spacing)
    panels = [
        Panel(
            ("a", "Mimicking problem", 0.0, 0.8),
            lambda figure: _problem(figure, study, initial),
            _PROSE["a"],
        ),
        Panel(
            ("", "Gradient-based optimisation", LOOP - 4.2, 0.8),
            lambda figure: _loop(figure, design),
        ),
        Panel(
            ("b", "Rigid units, elastic ligaments, contact", 0.0, SECOND),
            lambda figure: model_panel.ligament_panel(
                style.place(figure, 0.0, SECOND + 6.0, 58.0, SMALL + 2.0), cloaked, _lying(cloaked)
            ),
            _PROSE["b"],
        ),
        Panel(
            ("c", "Shield excitations, conceal inclusions", 64.0, SECOND),
            lambda figure: _kinds(figure, study, initial),
            _PROSE["c"],
        ),
        Panel(
            ("d", "From the design to the experiment", 0.0, THIRD),
            lambda figure: _making(figure, study, cloaked),
            _PROSE["d"],
        ),
    ]
    remark = measured_overlay.caption(study.recordings, banded=False)
    return PanelFigure(HEIGHT, panels, remark=remark)


def _problem(figure: Figure, study: StudyResults, initial: RigidUnits) -> None:
    spacing = study.scene.spacing
    top = 11.0
    reference = style.place(figure, 0.0, top, SIDE, SIDE)
    domain_panels.domain(reference, initial, spacing, cloaked=False)
    altered = style.place(figure, 61.0, top, SIDE, SIDE)
    domain_panels.excitation(altered, initial, spacing, study.scene.radii[-1])
    for left, name, colour in ((0.0, "Reference", style.INTACT), (61.0, "Altered", style.ALTERED)):
        _write(figure, left + SIDE / 2, top - 1.2, name, color=colour, va="bottom")
    notes = (
        (SIDE / 2, r"$\mathbf{u}^\mathrm{R}(\mathbf{x},t)$"),
        (61.0 + SIDE / 2, r"$\mathbf{u}^\mathrm{C}_{\boldsymbol{\xi}}(\mathbf{x},t)$"),
    )
    for x, text in notes:
        _write(figure, x, top + SIDE + 0.5, text.replace("boldsymbol", "mathbf"), va="top")
    _arrow(figure, (45.5, top + SIDE / 2), (58.5, top + SIDE / 2), kind="<|-|>")
    _write(figure, 52.0, top + SIDE / 2 - 2.0, "alike in the\nregion of\ninterest", va="bottom")
    for k, (tint, text) in enumerate(
        ((domain_panels.INTEREST_TINT, "region of interest"), (CLOAK_TINT, "cloak"))
    ):
        y = top + SIDE / 2 + 4.0 + 10.5 * k
        _box(figure, (49.5, y, 5.0, 2.6), tint)
        _write(figure, 52.0, y + 3.0, text.replace(" of ", "\nof ") if k == 0 else text, va="top")


def _loop(figure: Figure, design: xr.Dataset) -> None:
    """Draws row a, right: the loss falls, its gradient by a differentiable simulation."""
    left, wide = LOOP, 65.0
    _box(figure, (left, 9.0, wide, 47.0), "#f6f4f9")
    formula = (
        r"$\min_{\xi\in D}\ J(\xi)=\int_t\int_{\Omega_\mathrm{ROI}}"
        r" g(\mathbf{u}^\mathrm{R},\mathbf{u}^\mathrm{C}_\xi)\,\mathrm{d}\mathbf{x}\,\mathrm{d}t$"
    )
    _write(figure, left + wide / 2, 14.0, formula, fontsize=style.TITLE)
    steps = ("simulate", r"$\mathrm{d}J/\mathrm{d}\xi$", r"update $\xi$")
    for k, text in enumerate(steps):
        x = left + 3.0 + 20.5 * k
        _box(figure, (x, 19.0, 17.0, 6.5), "white", edge=style.CLOAKED)
        _write(figure, x + 8.5, 22.25, text)
        if k:
            _arrow(figure, (x - 3.3, 22.25), (x - 0.2, 22.25))
    right = left + 3.0 + 41.0 + 8.5
    _arrow(figure, (right, 25.7), (left + 11.5, 25.7), bend=-0.22)
    _write(figure, left + wide / 2, 33.2, "until it falls no more", color=style.GREY)
    axes = style.place(figure, left + 11.0, 37.0, wide - 15.0, 12.0)
    for method in design["method"].values:
        history = design.sel({"method": method})
        loss = history["loss"].where(history["accepted"] > 0).dropna("evaluation")
        colour = style.METHOD_COLOURS.get(str(method), style.GREY)
        axes.plot(loss["evaluation"], loss, color=colour, label=str(method).upper())
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator())
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_ylabel("Loss $J$", labelpad=1.0)
    axes.set_xlabel("Evaluation", labelpad=1.0)
    axes.legend(loc="upper right", ncols=2, fontsize=style.SMALL, borderaxespad=0.0)


def _lying(structure: RigidUnits) -> int:
    """Finds a ligament along x in the surroundings, near the middle of the bottom."""
    ends = structure.vertices[structure.ligament_unit, structure.ligament_vertex]
    along = np.abs(ends[:, 1] - ends[:, 0])
    outside = (structure.region[structure.ligament_unit] != CLOAK).all(axis=1)
    lying = np.flatnonzero((along[:, 0] > 4 * along[:, 1]) & outside)
    middle = np.array([structure.site[:, 0].mean(), structure.site[:, 1].min()])
    away = np.linalg.norm(ends[lying].mean(axis=1) - middle, axis=1)
    return int(lying[np.argmin(away)])


def _kinds(figure: Figure, study: StudyResults, initial: RigidUnits) -> None:
    """Draws row b, right: what cloaks can do."""
    spacing, radius = study.scene.spacing, study.scene.radii[-1]
    first = style.place(figure, 70.0, SECOND + 7.0, SMALL, SMALL)
    domain_panels.excitation(first, initial, spacing, radius)
    second = style.place(figure, 122.0, SECOND + 7.0, SMALL + 12.0, SMALL)
    domain_panels.inclusion(second, initial, spacing, radius)
    for x, text in ((70.0 + SMALL / 2, "excitation"), (128.0 + SMALL / 2, "inclusion under load")):
        _write(figure, x, SECOND + 7.0 + SMALL + 0.3, text, va="top")


def _making(figure: Figure, study: StudyResults, cloaked: RigidUnits) -> None:
    """Draws row c: the optimised cloak is made, filmed, tracked and compared."""
    response, spacing = study.response, study.scene.spacing
    case = measures.nearest_case(response, MONITORED)
    motion = response["displacement"].sel(structure="cloaked").isel(case=case)
    frames = motion.transpose("time", "unit", "dof").values
    peak = frames[np.abs(frames[..., :2]).max(axis=(1, 2)).argmax()]
    window = (np.array(study.scene.middle), 2.6 * spacing)
    lefts = [0.0, 44.5, 89.0, 141.0]
    top = THIRD + 9.0
    first, second, third = (style.place(figure, left, top, SMALL, SMALL) for left in lefts[:3])
    domain_panels.domain(first, cloaked, spacing, cloaked=True)
    domain_panels.cut(second, cloaked, window)
    domain_panels.filmed(third, cloaked, peak, window)
    names = ("optimised cloak", "units and shims, cut", "filmed and tracked")
    for left, text in zip(lefts, names, strict=False):
        _write(figure, left + SMALL / 2, top + SMALL + 0.6, text, va="top")
    for left, right in ((35.5, 43.0), (80.0, 87.5), (124.5, 131.0)):
        _arrow(figure, (left, top + SMALL / 2), (right, top + SMALL / 2))
    _compared(figure, study, (lefts[3], top + 2.0))
    _write(
        figure, lefts[3] + SMALL / 2, top + SMALL + 0.6, "compared with the simulation", va="top"
    )


def _compared(figure: Figure, study: StudyResults, at: tuple[float, float]) -> None:
    """Draws motion of one unit as simulated, and as measured where there is a recording."""
    axes = style.place(figure, *at, SMALL + 2.0, SMALL - 9.0)
    series = monitored(study.scene, study.response)
    for name in ("altered", "cloaked"):
        colour = style.STRUCTURE_COLOURS[name]
        axes.plot(series["time"], series.sel(structure=name), color=colour, lw=1.0)
    unit = middle_of_top_edge(from_dataset(study.response.isel(structure=0), study.scene.spacing))
    recordings = list(monitored_recordings(study))
    for each in recordings:
        values = each.values(each.data["measured"].isel(unit=unit).sel(dof="uy"))
        measured_overlay.measured_curve(
            axes, each.along, values, style.STRUCTURE_COLOURS[each.structure]
        )
    if recordings:
        axes.set_title(f"dots: {recordings[0].source}", fontsize=style.SMALL, pad=2.0)
    axes.set_xlabel("$t$ (s)", labelpad=1.0)
    axes.set_ylabel("$u_y$ (mm)", labelpad=1.0)
    scale_wide_numbers(axes)


def _write(figure: Figure, x: float, y: float, text: str, **told: str | float) -> None:
    settings: dict[str, str | float] = {"ha": "center", "va": "center", "fontsize": style.TEXT}
    style.write(figure, x, y, text, multialignment="center", **(settings | told))


def _box(
    figure: Figure, place: tuple[float, float, float, float], colour: str, edge: str = "none"
) -> None:
    """Draws a rounded box: left, top, width and height in mm."""
    left, top, wide, high = place
    corner = (left / style.TWO_COLUMNS, 1 - (top + high) / HEIGHT)
    look: dict[str, Any] = {"facecolor": colour, "edgecolor": edge, "linewidth": 0.7, "zorder": -1}
    look["boxstyle"] = "round,pad=0,rounding_size=0.006"
    look["mutation_aspect"] = style.TWO_COLUMNS / HEIGHT
    figure.add_artist(FancyBboxPatch(corner, wide / style.TWO_COLUMNS, high / HEIGHT, **look))


def _arrow(
    figure: Figure,
    start: tuple[float, float],
    end: tuple[float, float],
    bend: float = 0.0,
    kind: str = "-|>",
) -> None:
    """Draws an arrow between two points in mm from the page's top-left corner."""
    tail, tip = ((x / style.TWO_COLUMNS, 1 - y / HEIGHT) for x, y in (start, end))
    look: dict[str, Any] = {"arrowstyle": kind, "connectionstyle": f"arc3,rad={bend}"}
    look |= {"mutation_scale": 8.0, "shrinkA": 0, "shrinkB": 0, "lw": 1.0, "color": CLAMP_TINT}
    figure.add_artist(FancyArrowPatch(tail, tip, **look))
