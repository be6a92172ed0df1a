"""Describes the model of one ligament between two rigid units, from the geometry of a design."""

from typing import Any

import matplotlib.patheffects as effects
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Polygon

from reports.base import style
from reports.panels import arrow, point
from reports.study import RigidUnits
from sim.core import Floats

TINT = "#dfe3e7"
_HALO: list[effects.AbstractPathEffect] = [effects.withStroke(linewidth=2.2, foreground="white")]


def ligament_panel(axes: Axes, structure: RigidUnits, ligament: int) -> None:
    """Draws two units, the springs between them, their freedoms and the angle of contact."""
    units, corners = structure.ligament_unit[ligament], structure.ligament_vertex[ligament]
    shapes = [structure.vertices[unit] for unit in units]
    ends = np.array([shape[corner] for shape, corner in zip(shapes, corners, strict=True)])
    for shape in shapes:
        known = shape[~np.isnan(shape[:, 0])]
        axes.add_patch(Polygon(known, facecolor=TINT, edgecolor=style.INTACT, lw=0.7, zorder=2))
    for unit in units:
        _freedoms(axes, structure.centroid[unit])
    _springs(axes, ends)
    _contact(axes, shapes, corners, ends)
    low, high = np.nanmin(shapes, axis=(0, 1)) - 1.6, np.nanmax(shapes, axis=(0, 1)) + 1.6
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.set_axis_off()


def _freedoms(axes: Axes, centre: Floats) -> None:
    """Draws arrows of u_x, u_y and theta at a unit's centroid."""
    for way, name in (((2.3, 0.0), "$u_x$"), ((0.0, 2.3), "$u_y$")):
        arrow(axes, centre, centre + np.array(way), style.INTACT, 5.0, linewidth=0.7, zorder=6)
        x, y = centre + 1.28 * np.array(way)
        axes.text(x, y, name, fontsize=style.SMALL, ha="center", va="center", zorder=8)
    axes.add_patch(Arc(point(centre), 2.6, 2.6, theta1=150, theta2=300, lw=0.7, zorder=6))
    axes.text(
        centre[0] - 1.9, centre[1] - 1.3, r"$\theta$",
        fontsize=style.SMALL, ha="center", va="center", zorder=8,
    )  # fmt: skip


def _springs(axes: Axes, ends: Floats) -> None:
    """Draws the ligament as a spring, and its three stiffnesses."""
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    across = np.array([-along[1], along[0]]) / length
    part = np.linspace(0.0, 1.0, 9)
    swing = np.array([0, 0, 1, -1, 1, -1, 1, 0, 0]) * 0.45
    line = ends[0] + part[:, None] * along + swing[:, None] * across
    axes.plot(*line.T, color=style.CLOAKED, lw=1.0, zorder=5)
    axes.plot(*ends.T, "o", color=style.CLOAKED, ms=2.4, zorder=6)
    _word(axes, ends.mean(axis=0) - 2.6 * across, r"$k_\ell,\ k_s,\ k_\theta$", style.CLOAKED)


def _contact(axes: Axes, shapes: list[Floats], corners: Floats, ends: Floats) -> None:
    """Draws the angle of the void above the ligament, at which units come to touch."""
    sides = []
    for shape, corner, end in zip(shapes, corners, ends, strict=True):
        known = shape[~np.isnan(shape[:, 0])]
        near = [known[(corner + step) % len(known)] - end for step in (-1, 1)]
        sides.append(max(near, key=lambda side: float(side[1])))
    middle = ends.mean(axis=0)
    angles = sorted(float(np.degrees(np.arctan2(side[1], side[0]))) for side in sides)
    look: dict[str, Any] = {"color": style.ALTERED, "lw": 1.0, "zorder": 6}
    axes.add_patch(Arc(point(middle), 7.0, 7.0, theta1=angles[0], theta2=angles[1], **look))
    at = np.radians(np.mean(angles))
    away = 8.4 * np.array([np.cos(at), np.sin(at)])
    _word(axes, middle + away, r"contact: $\varphi$", style.ALTERED)


def _word(axes: Axes, place: Floats, words: str, colour: str) -> None:
    centred: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": style.TEXT}
    text = axes.text(place[0], place[1], words, color=colour, zorder=8, **centred)
    text.set_path_effects(_HALO)
