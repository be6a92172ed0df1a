"""Builds the specimen of a design: units with slots, ids and dots, and shims."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely
from shapely import Polygon

from pipeline.fabrication.engraving import orientation_mark, place_id
from pipeline.fabrication.parts import (
    LETTERS,
    BuiltSpecimen,
    Ligament,
    Shim,
    Slot,
    UnbuildableUnitError,
    Unit,
)
from pipeline.fabrication.units.slot_candidates import Corner, side_truncations
from pipeline.fabrication.units.slots import NoRoomError, place_slots
from pipeline.fabrication.units.tracking_dots import dots
from pipeline.fabrication.units.unit_network import UnitNetwork, corners, refuse_overlaps
from pipeline.fabrication.units.unit_outlines import cut, filleted, lugs, room_to_grow, wall
from pipeline.problem.sections import Fabrication
from sim.core import Floats

_STAGES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the most that a unit may grow
_NEAR = 3.0  # mm; farther neighbours never matter
_HAIR = 1e-6
_ROUNDING = 3e-3  # mm, of outlines as they are cut


def build_specimen(
    net: UnitNetwork,
    settings: Fabrication,
    names: tuple[str, str],
    file: Path,
    done: Callable[[], None] = lambda: None,
) -> BuiltSpecimen:
    """Builds the specimen of a structure.

    Args:
        net: the structure.
        settings: of the fabrication.
        names: of the study and of the structure.
        file: the design dataset, for messages.
        done: called after each unit.

    Raises:
        UnbuildableUnitError: units overlap, a slot or an id has no room; names the unit and what to
            change.
    """
    refuse_overlaps(net, file)
    slotted = corners(net)
    bodies = dict(net.polygons)  # grows as units are thickened
    order = list(net.numbers)
    tree = shapely.STRtree([net.polygons[number] for number in order])
    units, letters = {}, LETTERS
    for number in order:
        near = tree.query(net.polygons[number], "dwithin", _NEAR)
        neighbours = [bodies[order[at]] for at in near if order[at] != number]
        units[number], bodies[number] = build_unit(
            net, number, slotted[number], neighbours, settings, file, letters
        )
        letters = letters.replace(units[number].letter, "", 1)
        done()
    joints = _ligaments(net, units)
    clamped, driven = (tuple(net.labels[n] for n in held) for held in (net.clamped, net.driven))
    shims = _shims(joints, settings)
    return BuiltSpecimen(*names, tuple(units.values()), joints, shims, clamped, driven)


def build_unit(
    net: UnitNetwork,
    number: int,
    slotted: Sequence[Corner],
    neighbours: Sequence[Polygon],
    settings: Fabrication,
    file: Path,
    letters: str = LETTERS,
) -> tuple[Unit, Polygon]:
    """Builds a unit, and its body without slots.

    Args:
        net: the structure.
        number: of the unit.
        slotted: its vertices that take a slot.
        neighbours: bodies of the units around it.
        settings: of the fabrication.
        file: the design dataset, for messages.
        letters: it carries one of these where there is no room for its id.

    Raises:
        UnbuildableUnitError: a slot or its id has no room.
    """
    label, design = net.labels[number], net.polygons[number]
    body, slots = _body(net, number, slotted, neighbours, settings, file)
    outline = cut(body, slots, settings)
    for words in (label, *letters):
        placed = place_id(words, outline, body, settings.labels)
        if placed is not None:
            break
    else:
        what = f"no room for the id of unit {label}"
        remedy = "ask for larger units in the design (constraints.edge_length)"
        key = "fabrication.labels.height"
        raise UnbuildableUnitError(what, (design,), outline, file=file, key=key, remedy=remedy)
    grown = body.area - filleted(design, settings.fillet_radius).area
    unit = Unit(
        number,
        label,
        *net.index[number],
        design,
        outline,
        slots,
        placed.strokes,
        orientation_mark(outline, body, placed.box, settings.labels),
        dots(outline, settings.markers),
        settings.thickness,
        placed.mirrored,
        float(grown) if grown > _HAIR else 0.0,
        "" if words == label else words,
    )
    return unit, body


def _body(
    net: UnitNetwork,
    number: int,
    slotted: Sequence[Corner],
    neighbours: Sequence[Polygon],
    settings: Fabrication,
    file: Path,
) -> tuple[Polygon, tuple[Slot, ...]]:
    """Grows a unit as little as its slots need, and places these; they are not cut yet."""
    design = net.polygons[number]
    plain = filleted(design, settings.fillet_radius)
    failure = NoRoomError(None, 0.0)
    for share in _STAGES if settings.slots.thicken > 0.0 else _STAGES[:1]:
        growth = share * settings.slots.thicken
        room = room_to_grow(plain, neighbours, growth, settings) if share > 0.0 else plain
        try:
            chosen = place_slots(design, slotted, settings, room)
        except NoRoomError as error:
            failure = error
            continue
        body = lugs(plain, room, chosen, settings) if share > 0.0 else plain
        outline = cut(body, chosen, settings)
        slots = tuple(
            replace(
                slot,
                truncation=max(side_truncations(body, slot, settings)),
                wall=min(slot.wall, wall(outline, slot)),
            )
            for slot in chosen
        )
        if all(_is_held(slot, settings) for slot in slots):
            return body, slots
    raise _no_slot(net.labels[number], design, failure, settings, file)


def _is_held(slot: Slot, settings: Fabrication) -> bool:
    """Tests that a shim is held long enough, between thick enough walls."""
    grip, least = slot.depth - slot.truncation, settings.slots.depth_min
    return grip >= least - _HAIR and slot.wall >= settings.minimum_wall - _ROUNDING


def _no_slot(
    label: str, design: Polygon, failure: NoRoomError, settings: Fabrication, file: Path
) -> UnbuildableUnitError:
    least = math.floor(10 * failure.wall) / 10
    value = f"{settings.minimum_wall:g} mm"
    where, spot = "its slots meet", design.exterior
    if failure.vertex is not None:
        where = f"at vertex {failure.vertex}"
        spot = shapely.Point(design.exterior.coords[failure.vertex])
    wider = f"to {least:g} mm " if 0.0 < least < settings.minimum_wall else ""
    return UnbuildableUnitError(
        f"unit {label} is too slender for slots with walls of {value} ({where})",
        (design,),
        spot,
        file=file,
        key="fabrication.minimum_wall",
        value=value,
        remedy=f"lower it {wider}or fabrication.slots.depth_min, raise fabrication.slots.thicken,"
        " or ask for longer edges in the design (constraints.edge_length)",
    )


def _ligaments(net: UnitNetwork, units: dict[int, Unit]) -> tuple[Ligament, ...]:
    """Measures the ligaments between units (by id) as they are built."""
    ligaments = []
    for number, (a, p), (b, q), along in net.ligaments:
        one, other = (
            next(slot for slot in units[unit].slots if slot.vertex == vertex)
            for unit, vertex in ((a, p), (b, q))
        )
        gap = float(np.linalg.norm(other.mouth - one.mouth))
        length = round(gap + one.depth + other.depth, 4)
        free = gap + one.truncation + other.truncation
        bend = _angle(-one.direction, along) + _angle(along, other.direction)
        ligaments.append(Ligament(number, (net.labels[a], net.labels[b]), length, free, bend))
    return tuple(ligaments)


def _angle(first: Floats, second: Floats) -> float:
    cross = first[0] * second[1] - first[1] * second[0]
    return abs(float(np.arctan2(cross, first @ second)))


def _shims(ligaments: Sequence[Ligament], settings: Fabrication) -> tuple[Shim, ...]:
    """Sorts the pieces to cut, one kind for each length."""
    taken: dict[float, list[int]] = defaultdict(list)
    for ligament in ligaments:
        taken[ligament.length].append(ligament.number)
    spares = settings.shims.spares
    return tuple(
        Shim(
            f"S{length:g}",
            length,
            settings.thickness,
            tuple(taken[length]),
            max(1, math.ceil(spares * len(taken[length]))),
        )
        for length in sorted(taken)
    )


def summary(specimen: BuiltSpecimen) -> str:
    """Sums up a specimen in one line."""
    thickened = sum(unit.thickened > 0.0 for unit in specimen.units)
    free = max((ligament.free for ligament in specimen.ligaments), default=0.0)
    bend = math.degrees(max((ligament.bend for ligament in specimen.ligaments), default=0.0))
    return (
        f"{len(specimen.units)} units ({thickened} thickened beside their slots),"
        f" {sum(shim.count for shim in specimen.shims)} shims of {len(specimen.shims)} lengths,"
        f" free up to {free:.2f} mm, bent up to {bend:.0f} deg"
    )
