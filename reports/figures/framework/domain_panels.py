"""Draws pictures of the framework: domains with their regions, what is cut, what a camera sees."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import FancyArrowPatch, Rectangle

from reports.base import style
from reports.panels import draw, draw_clamps, drive_arrows, outline
from reports.study import CLAMPED, DRIVEN, SURROUNDINGS, RigidUnits, deformed
from sim.core import Floats

INTEREST_TINT, CLOAK_TINT, CLAMP_TINT = "#b9d3ea", "#c9b3e0", "#4a4d52"


def domain(axes: Axes, structure: RigidUnits, spacing: float, *, cloaked: bool) -> None:
    """Draws a lattice with its region of interest, and the region of the cloak if there is one."""
    draw_clamps(axes, structure, spacing)
    draw(axes, structure, colours=list(_tints(structure, cloaked=cloaked)))


def _tints(structure: RigidUnits, *, cloaked: bool) -> Iterator[str]:
    for region, support in zip(structure.region, structure.support, strict=True):
        if support == CLAMPED:
            yield CLAMP_TINT
        elif support == DRIVEN and cloaked:
            yield style.ALTERED
        elif region == SURROUNDINGS:
            yield INTEREST_TINT
        else:
            yield CLOAK_TINT if cloaked else style.PALE


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
    tints = np.where(
        away < 0.45 * radius, "white", np.where(away <= radius, CLOAK_TINT, INTEREST_TINT)
    )
    kept = away >= 0.45 * radius
    inside = kept[structure.ligament_unit].all(axis=1)
    vertices = np.where(kept[:, None, None], structure.vertices, np.nan)
    holed = RigidUnits(
        vertices,
        structure.site,
        structure.ligament_unit[inside],
        structure.ligament_vertex[inside],
        structure.region,
        structure.support,
    )
    draw(axes, holed, colours=[str(tint) for tint in tints], margin=18.0)
    outline(axes, middle, [radius], style.CLOAKED)
    reach = np.ptp(structure.site[:, 0]) / 2 + 0.8 * spacing
    low, high = axes.get_xlim()
    axes.set_xlim(low - 2.0 * spacing, high + 2.0 * spacing)
    for side in (-1.0, 1.0):
        for place in (-2.5, 0.0, 2.5):
            tip = middle + np.array([side * reach, place * spacing])
            tail = tip + np.array([side * 2.2 * spacing, 0.0])
            axes.add_patch(
                FancyArrowPatch(
                    (float(tail[0]), float(tail[1])),
                    (float(tip[0]), float(tip[1])),
                    arrowstyle="-|>",
                    mutation_scale=6.0,
                    shrinkA=0,
                    shrinkB=0,
                    lw=1.3,
                    color=style.ALTERED,
                )
            )


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
    """Shows a square about a point, in a frame."""
    (x, y), half = window
    axes.set(xlim=(x - half, x + half), ylim=(y - half, y + half), aspect="equal")
    axes.set_axis_off()
    axes.add_patch(
        Rectangle((x - half, y - half), 2 * half, 2 * half, fill=False, lw=0.8, zorder=9)
    )
