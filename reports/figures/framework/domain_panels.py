"""Draws pictures of the framework: domains with their regions, what is cut, what a camera sees."""

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import Rectangle

from reports.base import style
from reports.panels import (
    CLAMP_TINT,
    CLOAK_TINT,
    arrow,
    draw,
    draw_clamps,
    drive_arrows,
    outline,
    tints,
)
from reports.study import CLAMPED, DRIVEN, SURROUNDINGS, RigidUnits, deformed
from sim.core import Floats

INTEREST_TINT = "#b9d3ea"


def domain(axes: Axes, structure: RigidUnits, spacing: float, *, cloaked: bool) -> None:
    """Draws a lattice with its region of interest, and the region of the cloak if there is one."""
    draw_clamps(axes, structure, spacing)
    held = {CLAMPED: CLAMP_TINT} | ({DRIVEN: style.ALTERED} if cloaked else {})
    inner = CLOAK_TINT if cloaked else style.PALE
    draw(axes, structure, colours=tints(structure, held, {SURROUNDINGS: INTEREST_TINT}, inner))


def excitation(axes: Axes, structure: RigidUnits, spacing: float, radius: float) -> None:
    """Draws a driven unit within the cloak."""
    domain(axes, structure, spacing, cloaked=True)
    middle = structure.site.mean(axis=0)
    drive_arrows(axes, middle, 45.0, (0.75 * spacing, 2.6 * spacing), style.ALTERED)
    outline(axes, middle, [radius], style.CLOAKED)


def inclusion(axes: Axes, structure: RigidUnits, spacing: float, radius: float) -> None:
    """Draws a void within the cloak, and the load on two sides."""
    middle = structure.site.mean(axis=0)
    away = np.linalg.norm(structure.site - middle, axis=1)
    colours = np.where(away <= radius, CLOAK_TINT, INTEREST_TINT)
    kept = away >= 0.45 * radius
    inside = kept[structure.ligament_unit].all(axis=1)
    vertices = np.where(kept[:, None, None], structure.vertices, np.nan)
    holed = replace(
        structure,
        vertices=vertices,
        ligament_unit=structure.ligament_unit[inside],
        ligament_vertex=structure.ligament_vertex[inside],
    )
    draw(axes, holed, colours=colours.tolist(), margin=18.0)
    outline(axes, middle, [radius], style.CLOAKED)
    reach = np.ptp(structure.site[:, 0]) / 2 + 0.8 * spacing
    low, high = axes.get_xlim()
    axes.set_xlim(low - 2.0 * spacing, high + 2.0 * spacing)
    for side in (-1.0, 1.0):
        for place in (-2.5, 0.0, 2.5):
            tip = middle + np.array([side * reach, place * spacing])
            tail = tip + np.array([side * 2.2 * spacing, 0.0])
            arrow(axes, tail, tip, style.ALTERED)


def cut(axes: Axes, structure: RigidUnits, window: tuple[Floats, float]) -> None:
    """Draws outlines of units and the strips of foil that join them, as they are cut."""
    shapes = [shape[~np.isnan(shape[:, 0])] for shape in structure.vertices[structure.present]]
    axes.add_collection(PolyCollection(shapes, facecolors="#f4ede1", edgecolors="#1a1a1a", lw=0.6))
    units, corners = structure.ligament_unit, structure.ligament_vertex
    ends = structure.vertices[units, corners]
    inward = structure.centroid[units] - ends
    inward *= 3.0 / np.linalg.norm(inward, axis=2, keepdims=True)
    strips = np.stack(
        [ends[:, 0] + inward[:, 0], *np.moveaxis(ends, 1, 0), ends[:, 1] + inward[:, 1]], 1
    )
    axes.add_collection(LineCollection(list(strips), colors="#c8102e", lw=1.0))
    _window(axes, window)


def filmed(
    axes: Axes, structure: RigidUnits, displacement: Floats, window: tuple[Floats, float]
) -> None:
    """Draws dark units on a bright board, the outlines that are found, and how far they moved."""
    corners = deformed(structure, displacement)[structure.present]
    shapes = [shape[~np.isnan(shape[:, 0])] for shape in corners]
    axes.add_collection(PolyCollection(shapes, facecolors="#2b2b2b", edgecolors="#35b8c9", lw=0.9))
    start = structure.centroid
    moved = np.stack([start, start + displacement[:, :2]], axis=1)
    axes.add_collection(LineCollection(list(moved), colors=style.ALTERED, lw=1.1, zorder=4))
    axes.plot(*moved[:, 1].T, "o", color=style.ALTERED, ms=1.6, zorder=5)
    _window(axes, window)


def _window(axes: Axes, window: tuple[Floats, float]) -> None:
    (x, y), half = window
    axes.set(xlim=(x - half, x + half), ylim=(y - half, y + half), aspect="equal")
    axes.set_axis_off()
    axes.add_patch(
        Rectangle((x - half, y - half), 2 * half, 2 * half, fill=False, lw=0.8, zorder=9)
    )
