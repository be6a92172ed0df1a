"""Holds the parts of a specimen as data: units with their slots, shims, other flat parts.

All lengths in mm. Units lie in the specimen frame (with the lattice's origin, x to the right, y
up, seen from the top); z = 0 is the underside.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from shapely import Geometry, Polygon
from shapely.ops import substring

from pipeline.runtime import UserError
from sim.core import Floats

THIN_WALL = 0.9
"""Walls below this have no room for two lines of 0.45 mm side by side, and are warned of, mm."""

STRAIGHT = 1e-4
"""Strain below which a shim counts as straight."""

_STRAIN_DIGITS = 9
SHIM_PLAY = 0.1
"""Most that a shim may be shorter than from slot end to slot end, mm."""

LETTERS = "ABCDEFGHJKLMNPRSTUVXY4"
"""Engraved on small units in place of ids; none looks like another one that is turned."""

Strokes = tuple[Floats, ...]
"""Open polylines (n, 2)."""


class UnbuildableUnitError(UserError):
    """Reports a unit of a design that cannot be made, with what a picture of it needs.

    Args:
        what: the fault in one sentence, with the unit's label.
        around: outlines to show, mm.
        spot: where the fault is, mm.
        words: file, key, value and remedy of the error.
    """

    def __init__(
        self,
        what: str,
        around: tuple[Geometry, ...],
        spot: Geometry,
        **words: Any,  # noqa: ANN401
    ) -> None:
        super().__init__(what, **words)
        self.around = around
        self.spot = spot


@dataclass(frozen=True)
class Circle:
    """Holds a round hole, a dot, or a place of an outline that is not cut."""

    centre: tuple[float, float]
    diameter: float


@dataclass(frozen=True)
class FlatPart:
    """Holds a flat part: one outline that is cut, round holes, strokes that are engraved."""

    id: str  # unique in the package; the name of its files and objects
    outline: Polygon  # the outer loop, without holes, at nominal size
    height: float  # thickness of the sheet or of the printed part
    holes: tuple[Circle, ...] = ()  # inside the outline
    engraving: Strokes = ()  # lettering and orientation mark, to be read from the top
    scores: Strokes = ()  # lines to fold or to mark along
    tabs: tuple[Circle, ...] = ()  # where the outline is not cut, so that its sheet holds the part
    slot: float = np.inf  # width of its narrowest slot

    @cached_property
    def cuts(self) -> list[Floats]:
        """Outer cuts, polylines (n, 2) from tab to tab; without tabs the closed outline."""
        ring = self.outline.exterior
        if not self.tabs:
            return [np.asarray(ring.coords)]
        places = sorted((ring.project(shapely.Point(t.centre)), t.diameter / 2) for t in self.tabs)
        ends = [(at + half, after - more) for (at, half), (after, more) in pairwise(places)]
        pieces = [np.asarray(substring(ring, *piece).coords) for piece in ends]
        (first, before), (last, half) = places[0], places[-1]
        around = [(last + half, ring.length), (0.0, first - before)]
        end, start = (np.asarray(substring(ring, *piece).coords) for piece in around)
        return [*pieces, np.concatenate([end[:-1], start])]

    @cached_property
    def size(self) -> tuple[float, float]:
        """Width and height of its bounding box."""
        x0, y0, x1, y1 = self.outline.bounds
        return x1 - x0, y1 - y0

    def moved(self, x: float, y: float) -> FlatPart:
        """Moves the lower left corner of the bounding box to (x, y)."""
        shift = np.array([x, y]) - self.outline.bounds[:2]
        dx, dy = shift

        def there(circles: tuple[Circle, ...]) -> tuple[Circle, ...]:
            return tuple(Circle((c.centre[0] + dx, c.centre[1] + dy), c.diameter) for c in circles)

        return replace(
            self,
            outline=shapely.transform(self.outline, lambda points: points + shift),
            holes=there(self.holes),
            tabs=there(self.tabs),
            engraving=tuple(stroke + shift for stroke in self.engraving),
            scores=tuple(stroke + shift for stroke in self.scores),
        )


@dataclass(frozen=True)
class Slot:
    """Holds a slot at a vertex of a unit, for the end of one shim."""

    vertex: int  # number of the unit's vertex
    ligament: int  # id of the ligament
    mouth: Floats  # (2,) the vertex as designed
    direction: Floats  # (2,) unit vector from the mouth to the inner end
    depth: float  # from the vertex as designed to the inner end
    width: float  # shim thickness + 2 clearance
    truncation: float  # how far the tip beside the mouth is cut back, along the slot
    wall: float  # thinnest wall around the inner end, to the outline or to another slot

    @property
    def end(self) -> Floats:
        """(2,) the middle of the inner end."""
        return self.mouth + self.depth * self.direction

    @property
    def grip(self) -> float:
        """Length in which its walls hold the shim."""
        return self.depth - self.truncation

    @property
    def held(self) -> Floats:
        """(2,) where its walls begin to hold the shim."""
        return self.mouth + self.truncation * self.direction


@dataclass(frozen=True)
class Unit:
    """Holds one unit of the specimen, where it stands before any load."""

    number: int  # id in the datasets
    label: str  # id on the part and in all files: column letter and row number, from the lower left
    column: int  # lattice indices (i, j), from zero
    row: int
    design: Polygon  # as designed
    outline: Polygon  # the polygon to cut: with slots, truncated tips, filleted corners
    slots: tuple[Slot, ...]  # one for each ligament that ends here
    lettering: Strokes  # of the label, to be read from the top
    mark: Strokes  # the arrow that points to +y
    markers: tuple[Circle, ...]  # dots for tracking
    height: float  # in z
    underside: Strokes = ()  # the lettering, to be read from below, seen from the top
    thickened: float = 0.0  # area added beside slots so that their walls are thick enough, mm^2
    letter: str = ""  # carried instead of the id, where there is no room for that
    pins: tuple[Circle, ...] = ()  # holes for pins that align its layers, where it has some

    @property
    def wall(self) -> float:
        """Thinnest wall around the inner ends of its slots; infinite without slots."""
        return min((slot.wall for slot in self.slots), default=np.inf)

    @property
    def part(self) -> FlatPart:
        """The unit, or each of its layers, as a part to be cut."""
        engraved = self.lettering + self.mark
        width = min((slot.width for slot in self.slots), default=np.inf)
        return FlatPart(self.label, self.outline, self.height, self.pins, engraved, slot=width)


@dataclass(frozen=True)
class Ligament:
    """Holds one ligament of the specimen and the shim that it takes."""

    number: int  # id in the datasets
    labels: tuple[str, str]  # the units that it joins
    length: float  # of the shim, along it from one slot's inner end to the other's
    free: float  # of the shim between the truncated mouths, along it
    middle: tuple[float, float]  # (2,) of the ligament as designed
    angles: tuple[float, float] = (0.0, 0.0)  # of both slots against it, counter-clockwise, rad
    strain: float = 0.0  # largest one of the shim before any load
    moment: float = 0.0  # largest one in the shim before any load, N mm
    gap: float = 0.0  # between the vertices that it joins, as designed

    @property
    def name(self) -> str:
        """The units that it joins, "A1 - B1"."""
        return " - ".join(self.labels)


@dataclass(frozen=True)
class Shim:
    """Holds all shims of one length."""

    id: str  # "S" and the length
    length: float  # of a piece; the width is the thickness of the units
    width: float  # likewise
    ligaments: tuple[int, ...]  # that take it
    spares: int  # pieces more than ligaments

    @property
    def count(self) -> int:
        """Pieces to cut."""
        return len(self.ligaments) + self.spares


@dataclass(frozen=True)
class BuiltSpecimen:
    """Holds one structure of a study as it is built."""

    study: str  # name of the study
    structure: str  # intact, altered or cloaked
    units: tuple[Unit, ...]  # those present, in ascending order of their numbers
    ligaments: tuple[Ligament, ...]  # those present
    shims: tuple[Shim, ...]  # in ascending order of their lengths
    clamped: tuple[str, ...] = ()  # labels of the units that fixtures hold
    driven: tuple[str, ...] = ()  # likewise
    # labels of driven units that the same drives move, where there are several drives
    drives: tuple[tuple[str, ...], ...] = ()
    # by label of these units: ux, uy or theta that the study leaves free; fixtures hold them all
    free_dofs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    # axial, shear and bending stiffness of simulated ligaments over those of shims, by number,
    # where they are others
    stiffness: Mapping[int, tuple[float, ...]] = field(default_factory=dict)

    @property
    def drive_groups(self) -> tuple[tuple[str, ...], ...]:
        """Driven units that may be joined to one another, by label: they move alike."""
        return self.drives or ((self.driven,) if self.driven else ())

    @property
    def free_words(self) -> str:
        """Tells what the study leaves free of held units, "ux of A1, A2"; empty if nothing."""
        labels: dict[tuple[str, ...], list[str]] = {}
        for label, dofs in self.free_dofs.items():
            labels.setdefault(dofs, []).append(label)
        return "; ".join(f"{' and '.join(d)} of {', '.join(units)}" for d, units in labels.items())

    @cached_property
    def in_rows(self) -> bool:
        """Tests that ids tell columns and rows of the lattice, and not the order in a file.

        A file's units have the indices (0, 0), (1, 0), ...: they are a row only if they stand side
        by side, in this order.
        """
        if len({unit.row for unit in self.units}) > 1:
            return True
        row = sorted(self.units, key=lambda unit: unit.column)
        _, low, _, high = shapely.bounds([unit.design for unit in row]).T
        places = [unit.design.centroid.x for unit in row]
        return bool(low.max() < high.min()) and places == sorted(places)

    @property
    def letters(self) -> dict[str, str]:
        """Letters by label, of the units that carry one instead of their id."""
        return {unit.label: unit.letter for unit in self.units if unit.letter}

    @property
    def without_dots(self) -> list[str]:
        """Labels of the units that have no room for a tracking dot."""
        return [unit.label for unit in self.units if not unit.markers]

    @cached_property
    def by_label(self) -> dict[str, Unit]:
        """Units by label."""
        return {unit.label: unit for unit in self.units}

    @property
    def bent(self) -> list[Ligament]:
        """Ligaments whose shims are bent before any load, the most strained first.

        Mirrored ones are strained alike but for rounding, which is not to order them.
        """
        bent = [ligament for ligament in self.ligaments if ligament.strain > STRAIGHT]
        return sorted(bent, key=lambda one: (-round(one.strain, _STRAIN_DIGITS), one.number))

    @property
    def thin(self) -> dict[str, float]:
        """Thinnest walls by label, of the units that have thin ones."""
        return {unit.label: unit.wall for unit in self.units if unit.wall < THIN_WALL}


def column_letters(column: int) -> str:
    """Spells columns from zero as A, B, ... Z, AA, AB, ... as in a spreadsheet."""
    letters = ""
    column += 1
    while column:
        column, digit = divmod(column - 1, 26)
        letters = chr(ord("A") + digit) + letters
    return letters


def labels(indices: Iterable[tuple[int, int]]) -> list[str]:
    """Gives each lattice index (i, j) a unique label: "C7" is column 2, row 6.

    Units that share an index (the two triangles of a kagome cell) get a, b, ... behind it.
    """
    pairs = [(int(i), int(j)) for i, j in indices]
    shared = len(set(pairs)) < len(pairs)
    seen: dict[tuple[int, int], int] = {}
    names = []
    for pair in pairs:
        nth = seen.get(pair, 0)
        seen[pair] = nth + 1
        suffix = chr(ord("a") + nth) if shared else ""
        names.append(f"{column_letters(pair[0])}{pair[1] + 1}{suffix}")
    return names
