"""From a design to the specimen that is built: units with slots, ids and dots, and shims."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import shapely
from shapely import Polygon

from pipeline.fabrication.engraving import id_placement, orientation_mark, read_strokes, read_sunk
from pipeline.fabrication.parts import (
    LETTERS,
    BuiltSpecimen,
    Slot,
    Strokes,
    Unit,
    UnmadeError,
    layered_solids,
)
from pipeline.fabrication.units import slots, tracking_dots, unit_outlines
from pipeline.fabrication.units.shims import ligaments, shims
from pipeline.fabrication.units.slot_candidates import Corner, side_truncations
from pipeline.fabrication.units.slots import NoRoomError
from pipeline.fabrication.units.unit_network import UnitNetwork, corners, refuse_overlaps
from pipeline.problem.sections import Fabrication

_STAGES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the most that a unit may grow
_NEAR = 3.0  # mm; farther neighbours never matter
_HAIR = 1e-6
_ROUNDING = 3e-3  # mm, of outlines as they are made


def specimen(
    net: UnitNetwork,
    wanted: Fabrication,
    names: tuple[str, str],
    file: Path,
    done: Callable[[], None] = lambda: None,
) -> BuiltSpecimen:
    """What is built of a structure.

    Args:
        net: the structure.
        wanted: how it is made.
        names: of the study and of the structure.
        file: the design dataset, for messages.
        done: called after each unit.

    Raises:
        UnmadeError: units overlap, a slot or an id has no room; names the unit and what to change.
    """
    refuse_overlaps(net, file)
    slotted = corners(net)
    bodies = dict(net.polygons)  # grows as units are thickened
    order = list(net.numbers)
    tree = shapely.STRtree([net.polygons[number] for number in order])
    units, letters = [], LETTERS
    for number in order:
        near = tree.query(net.polygons[number], "dwithin", _NEAR)
        neighbours = [bodies[order[at]] for at in near if order[at] != number]
        made, bodies[number] = unit(net, number, slotted[number], neighbours, wanted, file, letters)
        letters = letters.replace(made.letter, "", 1)
        units.append(made)
        done()
    joined = ligaments(net, {one.number: one for one in units})
    return BuiltSpecimen(
        *names,
        tuple(units),
        joined,
        shims(joined, wanted),
        tuple(net.labels[number] for number in net.clamped),
        tuple(net.labels[number] for number in net.driven),
    )


def unit(
    net: UnitNetwork,
    number: int,
    slotted: Sequence[Corner],
    neighbours: Sequence[Polygon],
    wanted: Fabrication,
    file: Path,
    letters: str = LETTERS,
) -> tuple[Unit, Polygon]:
    """A unit as made, and its body without slots.

    Args:
        net: the structure.
        number: of the unit.
        slotted: its vertices that take a slot.
        neighbours: bodies of the units around it.
        wanted: how it is made.
        file: the design dataset, for messages.
        letters: it carries one of these where there is no room for its id.

    Raises:
        UnmadeError: a slot or its id has no room.
    """
    label, design = net.labels[number], net.polygons[number]
    body, cuts = _body(design, slotted, neighbours, wanted, label, file)
    outline = unit_outlines.cut(body, cuts, wanted)
    for words in (label, *letters):
        written = _written(words, outline, body, wanted)
        if written is not None:
            break
    else:
        what = f"no room for the id of unit {label}"
        remedy = "ask for larger units in the design (constraints.edge_length)"
        key = "fabrication.labels.height"
        raise UnmadeError(what, (design,), outline, file=file, key=key, remedy=remedy)
    placed, mark = written
    dots = tracking_dots.dots(outline, wanted.markers)
    grown = body.area - unit_outlines.filleted(design, wanted.fillet_radius).area
    made = Unit(
        number,
        label,
        *net.index[number],
        design,
        outline,
        cuts,
        placed.strokes,
        mark,
        dots,
        wanted.thickness,
        placed.mirrored,
        float(grown) if grown > _HAIR else 0.0,
        "" if words == label else words,
    )
    return made, body


def _written(
    words: str, outline: Polygon, body: Polygon, wanted: Fabrication
) -> tuple[id_placement.Placed, Strokes] | None:
    """Letters on a unit and the mark beside them; None if there is no room to read them."""
    placed = id_placement.fitted(words, outline, body, wanted.labels)
    if placed is None:
        return None
    mark = orientation_mark.mark(outline, body, placed.box, wanted.labels)
    if placed.kept < 1.0 - _HAIR:
        pose = read_strokes.read(words, placed.strokes + mark)
        below = outline.difference(layered_solids.sunk(placed.mirrored, mark, outline, wanted))
        if pose is None or not read_sunk.shows(words, below, outline, pose):
            return None
    return placed, mark


def _body(
    design: Polygon,
    slotted: Sequence[Corner],
    neighbours: Sequence[Polygon],
    wanted: Fabrication,
    label: str,
    file: Path,
) -> tuple[Polygon, tuple[Slot, ...]]:
    """The unit before its slots are cut, and the slots."""
    plain = unit_outlines.filleted(design, wanted.fillet_radius)
    failure = NoRoomError(None, 0.0)
    for share in _STAGES if wanted.slots.thicken > 0.0 else _STAGES[:1]:
        room = plain
        if share > 0.0:
            growth = share * wanted.slots.thicken
            room = unit_outlines.room_to_grow(plain, neighbours, growth, wanted)
        try:
            chosen = slots.place(design, slotted, wanted, room)
        except NoRoomError as error:
            failure = error
            continue
        body = unit_outlines.lugs(plain, room, chosen, wanted) if share > 0.0 else plain
        held = _measured(body, chosen, wanted)
        if all(_holds(slot, wanted) for slot in held):
            return body, held
    raise _no_slot(label, design, failure, wanted, file)


def _measured(body: Polygon, chosen: Sequence[Slot], wanted: Fabrication) -> tuple[Slot, ...]:
    """The slots with their truncations and walls in the body as it is made."""
    made = unit_outlines.cut(body, chosen, wanted)
    return tuple(
        replace(
            slot,
            truncation=max(side_truncations(body, slot, wanted)),
            wall=min(slot.wall, unit_outlines.wall(made, slot)),
        )
        for slot in chosen
    )


def _holds(slot: Slot, wanted: Fabrication) -> bool:
    """Whether a shim is held long enough, between thick enough walls."""
    grip = slot.depth - slot.truncation
    return grip >= wanted.slots.depth_min - _HAIR and slot.wall >= wanted.minimum_wall - _ROUNDING


def _no_slot(
    label: str, design: Polygon, failure: NoRoomError, wanted: Fabrication, file: Path
) -> UnmadeError:
    where = "its slots meet" if failure.vertex is None else f"at vertex {failure.vertex}"
    what = (
        f"unit {label} is too slender for slots with walls of {wanted.minimum_wall:g} mm ({where})"
    )
    least = math.floor(10 * failure.wall) / 10
    wall = f"to {least:g} mm " if 0.0 < least < wanted.minimum_wall else ""
    remedy = (
        f"lower it {wall}or fabrication.slots.depth_min, raise fabrication.slots.thicken, or ask"
        " for longer edges in the design (constraints.edge_length)"
    )
    corners = [shapely.Point(corner) for corner in design.exterior.coords]
    spot = design.exterior if failure.vertex is None else corners[failure.vertex]
    return UnmadeError(
        what,
        (design,),
        spot,
        file=file,
        key="fabrication.minimum_wall",
        value=f"{wanted.minimum_wall:g} mm",
        remedy=remedy,
    )


def summary(made: BuiltSpecimen) -> str:
    """What is built, in one line."""
    thickened = sum(unit.thickened > 0.0 for unit in made.units)
    free = max((ligament.free for ligament in made.ligaments), default=0.0)
    bend = math.degrees(max((ligament.bend for ligament in made.ligaments), default=0.0))
    return (
        f"{len(made.units)} units ({thickened} thickened beside their slots),"
        f" {sum(shim.count for shim in made.shims)} shims of {len(made.shims)} lengths,"
        f" free up to {free:.2f} mm, bent up to {bend:.0f} deg"
    )
