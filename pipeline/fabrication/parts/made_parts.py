"""What is made, as data: units with their slots, shims, and any other flat part.

All lengths in mm. Units lie in the specimen frame (origin at the lattice point of unit (0, 0), x to
the right, y up, seen from the top); z = 0 is the underside.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely
from shapely import Polygon

from sim.core import Floats

THIN_WALL = 1.2
"""Walls below this print, but break easily: they are warned of, mm."""

Strokes = tuple[Floats, ...]
"""Open polylines (n, 2)."""


@dataclass(frozen=True)
class Circle:
    """A round hole, or a dot."""

    centre: tuple[float, float]
    diameter: float


@dataclass(frozen=True)
class FlatPart:
    """A flat part: one outline that is cut, round holes, strokes that are engraved.

    Attributes:
        id: unique in the package; the name of its files and objects.
        outline: the outer loop, without holes, at nominal size.
        height: thickness of the sheet or of the printed part.
        holes: inside the outline.
        engraving: lettering and orientation mark, to be read from the top.
        scores: lines to fold or to mark along.
    """

    id: str
    outline: Polygon
    height: float
    holes: tuple[Circle, ...] = ()
    engraving: Strokes = ()
    scores: Strokes = ()

    @cached_property
    def size(self) -> tuple[float, float]:
        """Width and height of its bounding box."""
        x0, y0, x1, y1 = self.outline.bounds
        return x1 - x0, y1 - y0

    def moved(self, x: float, y: float) -> FlatPart:
        """The part with the lower left corner of its bounding box at (x, y)."""
        x0, y0, _, _ = self.outline.bounds
        shift = np.array([x - x0, y - y0])
        return FlatPart(
            self.id,
            shapely.transform(self.outline, lambda points: points + shift),
            self.height,
            tuple(
                Circle((hole.centre[0] + shift[0], hole.centre[1] + shift[1]), hole.diameter)
                for hole in self.holes
            ),
            tuple(stroke + shift for stroke in self.engraving),
            tuple(stroke + shift for stroke in self.scores),
        )


@dataclass(frozen=True)
class Slot:
    """A slot at a vertex of a unit, for the end of one shim.

    Attributes:
        vertex: which of the unit's vertices.
        ligament: id of the ligament.
        mouth: (2,) the vertex as designed.
        direction: (2,) unit vector from the mouth to the inner end.
        depth: from the vertex as designed to the inner end.
        width: shim thickness + 2 clearance.
        truncation: how far the tip beside the mouth is cut back, along the slot.
        wall: thinnest wall around the inner end, to the outline or to another slot.
    """

    vertex: int
    ligament: int
    mouth: Floats
    direction: Floats
    depth: float
    width: float
    truncation: float
    wall: float

    @property
    def end(self) -> Floats:
        """(2,) the middle of the inner end."""
        return self.mouth + self.depth * self.direction


@dataclass(frozen=True)
class Unit:
    """One unit of the specimen, where it stands before any load.

    Attributes:
        number: id in the datasets.
        label: id on the part and in all files: column letter and row number, from the lower left.
        column, row: lattice indices (i, j), from zero.
        design: the polygon as designed.
        outline: the polygon as made: slots cut, tips truncated, corners filleted.
        slots: one for each ligament that ends here.
        lettering: strokes of the label, to be read from the top.
        underside: the same, to be read from below, seen from the top.
        mark: strokes of the arrow that points to +y.
        markers: the tracking dots.
        height: in z.
        thickened: area added beside slots so that their walls are thick enough, mm^2.
        letter: what it carries instead of its id, where there is no room for that.
    """

    number: int
    label: str
    column: int
    row: int
    design: Polygon
    outline: Polygon
    slots: tuple[Slot, ...]
    lettering: Strokes
    mark: Strokes
    markers: tuple[Circle, ...]
    height: float
    underside: Strokes = ()
    thickened: float = 0.0
    letter: str = ""

    @property
    def wall(self) -> float:
        """Thinnest wall around the inner ends of its slots; infinite without slots."""
        return min((slot.wall for slot in self.slots), default=np.inf)

    @property
    def part(self) -> FlatPart:
        """The unit as a part to be cut."""
        return FlatPart(self.label, self.outline, self.height, engraving=self.lettering + self.mark)


@dataclass(frozen=True)
class Ligament:
    """One ligament of the specimen and the shim that it takes.

    Attributes:
        number: id in the datasets.
        labels: the units that it joins.
        length: of the shim: distance of the vertices and both depths.
        free: of the shim between the truncated mouths.
        bend: between the slots at its two ends, rad; zero for a straight shim.
    """

    number: int
    labels: tuple[str, str]
    length: float
    free: float
    bend: float


@dataclass(frozen=True)
class Shim:
    """All shims of one length.

    Attributes:
        id: "S" and the length.
        length, width: of a piece; the width is the thickness of the units.
        ligaments: that take it.
        spares: pieces more than ligaments.
    """

    id: str
    length: float
    width: float
    ligaments: tuple[int, ...]
    spares: int

    @property
    def count(self) -> int:
        """Pieces to cut."""
        return len(self.ligaments) + self.spares


@dataclass(frozen=True)
class BuiltSpecimen:
    """One structure of a study as it is built.

    Attributes:
        study: name of the study.
        structure: intact, altered or cloaked.
        units: those present, in ascending order of their numbers.
        ligaments: those present.
        shims: in ascending order of their lengths.
        clamped, driven: labels of the units that fixtures hold.
    """

    study: str
    structure: str
    units: tuple[Unit, ...]
    ligaments: tuple[Ligament, ...]
    shims: tuple[Shim, ...]
    clamped: tuple[str, ...] = ()
    driven: tuple[str, ...] = field(default=())

    @property
    def letters(self) -> dict[str, str]:
        """Letters by label, of the units that carry one instead of their id."""
        return {unit.label: unit.letter for unit in self.units if unit.letter}

    @cached_property
    def by_label(self) -> dict[str, Unit]:
        """Units by label."""
        return {unit.label: unit for unit in self.units}

    @property
    def thin(self) -> dict[str, float]:
        """Thinnest walls by label, of the units that have thin ones."""
        return {unit.label: unit.wall for unit in self.units if unit.wall < THIN_WALL}
