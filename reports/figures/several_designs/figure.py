"""Composes the figure of several designs: how well each shields, and the designs."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reports.base import prose, style
from reports.figures.several_designs.designs import RADIUS, DesignSeries, SeriesDesign
from reports.panels import Panel, PanelFigure, colour_bar, draw, draw_clamps, outline
from reports.study import from_dataset

PER_ROW = 3
"""Panels in a row; the first is the curve."""

LEFT, BAR, GAP, HEAD = 2.0, 16.0, 2.0, 11.0
_PROSE = prose(__file__)


def design_series_figure(family: DesignSeries) -> PanelFigure:
    """Returns the figure: curve and altered structure, then the designs, coloured alike."""
    side = (style.TWO_COLUMNS - LEFT - BAR) / PER_ROW - GAP
    rows = -(-(2 + len(family.designs)) // PER_ROW)
    over = "the size of the cloak" if family.key == RADIUS else family.key
    panels = [
        Panel(
            ("a", "Shielding of the boundary", 0.0, 0.8),
            lambda figure: _curve(style.place(figure, 13.0, HEAD, side - 9.0, side - 12.0), family),
            _PROSE["a"].format(over=over),
        ),
        Panel(
            ("b", "Peak displacement", side + GAP, 0.8),
            lambda figure: _structures(figure, family, side, rows),
            _PROSE["b"],
        ),
    ]
    draft = [reason for design in family.designs for reason in design.study.draft]
    return PanelFigure(rows * (side + HEAD), panels, draft)


def _structures(figure: Figure, family: DesignSeries, side: float, rows: int) -> None:
    shown = [(family.designs[0], "altered"), *((each, "cloaked") for each in family.designs)]
    norm = Normalize(0.0, _limit(family))
    for k, (design, name) in enumerate(shown, start=1):
        left = LEFT + (k % PER_ROW) * (side + GAP)
        top = HEAD + (k // PER_ROW) * (side + HEAD)
        axes = style.place(figure, left, top, side, side)
        _structure(axes, family, design, name, norm)
    left, height = LEFT + PER_ROW * (side + GAP) + 1.0, rows * (side + HEAD) - HEAD
    place, label = (left, HEAD + 0.0625 * height, 0.875 * height), r"$U_\mathrm{peak}$"
    colour_bar(figure, norm, style.MAGNITUDE, place, label, extend="max").locator = MaxNLocator(5)


def _limit(family: DesignSeries) -> float:
    """Returns largest peak outside the cloaks, rounded up: one range of colours for all."""
    largest = 0.0
    for design in family.designs:
        outside = design.study.response["roi"].values.astype(bool)
        largest = max(largest, float(design.peak.isel(unit=outside).max()))
    step = 10.0 ** np.floor(np.log10(largest)) / 2
    return float(np.ceil(largest / step - 1e-9) * step)


def _curve(axes: Axes, family: DesignSeries) -> None:
    sizes, label = family.axis
    for name, line in (("altered", "--"), ("cloaked", "-")):
        peaks = [float(design.boundary.sel(structure=name)) for design in family.designs]
        colour = style.STRUCTURE_COLOURS[name]
        axes.plot(sizes, peaks, line, color=colour, marker="o", ms=3.2, lw=1.1)
        at, words = (sizes[-1], peaks[-1]), name.capitalize()
        style.note(axes, at, words, (0, 6), ha="right", color=colour, fontsize=style.TEXT)
    top = max(float(design.boundary.max()) for design in family.designs)
    axes.set(xlabel=label, ylim=(0.0, 1.15 * top))
    axes.set_ylabel(r"$U^\mathrm{max}_{\partial\Omega}$", labelpad=2.0)
    axes.set_xticks(sizes)
    axes.margins(x=0.12)


def _structure(
    axes: Axes, family: DesignSeries, design: SeriesDesign, name: str, norm: Normalize
) -> None:
    scene, response = design.scene, design.study.response
    structure = from_dataset(response.sel(structure=name), scene.spacing)
    draw_clamps(axes, structure, scene.spacing)
    values = design.peak.sel(structure=name).values
    draw(axes, structure, values=values, colour_map=style.MAGNITUDE, norm=norm)
    if name == "cloaked":
        outline(axes, np.array(scene.middle), scene.radii, style.CLOAKED)
    title = "Altered" if name == "altered" else f"Cloaked, {family.label(design)}"
    colour = style.STRUCTURE_COLOURS[name]
    axes.set_title(title, color=colour, fontsize=style.TEXT, pad=1.5)
