"""A specimen of six squares, cut by hand: what the exporters and their checks start from."""

import numpy as np
import shapely
from shapely import Polygon

from pipeline.fabrication.parts import BuiltSpecimen, Circle, Ligament, Shim, Slot, Unit, labels
from pipeline.problem.sections import Fabrication
from sim.core import Floats

ASKED = Fabrication()
SPACING, HALF, BIAS = 15.0, 6.375, np.radians(20.0)
COLUMNS, ROWS = 3, 2
TRUNCATION = ASKED.slot_width / 2 + ASKED.slots.tip  # at a right angle


def square(i: int, j: int) -> Floats:
    """Vertices right, top, left and bottom of the unit (i, j)."""
    tilt = BIAS * (-1) ** (i + j + 1)
    angles = tilt + np.arange(4) * np.pi / 2
    corners = HALF / np.cos(BIAS) * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.add(corners, [SPACING * i, SPACING * j])


def neighbours() -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Ligaments as pairs of (unit, vertex)."""
    pairs = []
    for j in range(ROWS):
        for i in range(COLUMNS):
            unit = i + COLUMNS * j
            if i + 1 < COLUMNS:
                pairs.append(((unit, 0), (unit + 1, 2)))
            if j + 1 < ROWS:
                pairs.append(((unit, 1), (unit + COLUMNS, 3)))
    return pairs


def box_along(start: Floats, end: Floats, width: float) -> Polygon:
    """A rectangle around the line from start to end."""
    return Polygon(shapely.LineString([start, end]).buffer(width / 2, cap_style="flat"))


def slotted(corners: Floats, vertex: int, depth: float) -> tuple[Polygon, Polygon, Floats]:
    """Slot and truncated tip at a vertex, and the direction inwards."""
    mouth = corners[vertex]
    inwards = corners.mean(axis=0) - mouth
    inwards /= np.linalg.norm(inwards)
    slot = box_along(mouth - inwards, mouth + depth * inwards, ASKED.slot_width)
    tip = box_along(mouth - inwards, mouth + TRUNCATION * inwards, 4.0)
    return slot, tip, inwards


def specimen(depth: float = 3.0) -> BuiltSpecimen:
    """Three columns and two rows, a slot of `depth` at every ligament's end."""
    indices = [(i, j) for j in range(ROWS) for i in range(COLUMNS)]
    names = labels(indices)
    ends: dict[int, list[tuple[int, int]]] = {}
    ligaments = []
    for number, (first, second) in enumerate(neighbours()):
        for unit, vertex in (first, second):
            ends.setdefault(unit, []).append((vertex, number))
        pair = (names[first[0]], names[second[0]])
        free = 2.25 + 2 * TRUNCATION
        at = [square(*indices[unit])[vertex] for unit, vertex in (first, second)]
        x, y = np.mean(at, axis=0).tolist()
        ligaments.append(Ligament(number, pair, 2.25 + 2 * depth, free, (x, y)))
    units = [
        _unit(number, names[number], index, ends[number], depth)
        for number, index in enumerate(indices)
    ]
    length = 2.25 + 2 * depth
    shim = Shim(f"S{length:.2f}", length, ASKED.thickness, tuple(range(len(ligaments))), 1)
    return BuiltSpecimen("toy", "cloaked", tuple(units), tuple(ligaments), (shim,), ("A1", "C2"))


def _unit(
    number: int, label: str, index: tuple[int, int], ends: list[tuple[int, int]], depth: float
) -> Unit:
    corners = square(*index)
    design = Polygon(corners)
    outline, slots = design, []
    for vertex, ligament in ends:
        slot, tip, inwards = slotted(corners, vertex, depth)
        outline = Polygon(outline.difference(slot).difference(tip))
        place = vertex, ligament, corners[vertex], inwards
        slots.append(Slot(*place, depth, ASKED.slot_width, TRUNCATION, wall=1.0))
    centre = corners.mean(axis=0)
    letters = (np.add(centre, [[-1.0, -1.5], [-1.0, 1.5], [0.5, 1.5]]),)
    arrow = (np.add(centre, [[1.5, -1.0], [1.5, 1.0]]),)
    dots = (Circle((float(centre[0]), float(centre[1])), 2.0),)
    drawn = design, outline, tuple(slots)
    return Unit(number, label, *index, *drawn, letters, arrow, dots, ASKED.thickness)
