"""Grows units as little as their slots need, and places the slots at both ends of every shim.

The units take their turns. Each chooses its slots for those that stand at the other ends of its
shims; where a slot had to turn for its walls, the other one follows, so that the shim is bent to an
arc and not to an S. A second round makes good what the first did not know; a third changes nothing.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from shapely import Polygon

from pipeline.fabrication.parts import STRAIGHT, Slot, UnbuildableUnitError
from pipeline.fabrication.units.prebend import slender_strain, slot_angles
from pipeline.fabrication.units.slot_candidates import Corner, side_truncations
from pipeline.fabrication.units.slots import NoRoomError, place_slots
from pipeline.fabrication.units.unit_network import UnitNetwork, corners, refuse_faults
from pipeline.fabrication.units.unit_outlines import cut, filleted, lugs, room_to_grow, wall
from pipeline.problem.sections import Fabrication
from sim.core import Floats

_STAGES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the most that a unit may grow
_NEAR = 3.0  # mm; farther neighbours never matter
_HAIR = 1e-6
_ROUNDING = 3e-3  # mm, of outlines as they are cut
_BETTER = 0.99  # of the sum of squared strains, for which slots are moved


class UnitBody(NamedTuple):
    """Holds a unit without its slots, these, and the outline with them."""

    body: Polygon
    slots: tuple[Slot, ...]
    outline: Polygon


def unit_bodies(net: UnitNetwork, settings: Fabrication, file: Path) -> dict[int, UnitBody]:
    """Grows all units of a structure and places their slots, by id.

    Args:
        net: the structure.
        settings: of the fabrication.
        file: the design dataset, for messages.

    Raises:
        UnbuildableUnitError: a slot has no room.
    """
    order, slotted = list(net.numbers), corners(net)
    far = {(a, i): b for i, (a, _), (b, _), _ in net.ligaments}
    far |= {(b, i): a for i, (a, _), (b, _), _ in net.ligaments}
    tree = shapely.STRtree([net.polygons[number] for number in order])
    made: dict[int, UnitBody] = {}

    def facing(number: int, corner: Corner) -> Slot | None:
        across = made.get(far[number, corner.ligament])
        slots = () if across is None else across.slots
        return next((slot for slot in slots if slot.ligament == corner.ligament), None)

    def place(number: int) -> UnitBody:
        near = (order[at] for at in tree.query(net.polygons[number], "dwithin", _NEAR))
        bodies = [
            made[other].body if other in made else net.polygons[other]
            for other in near
            if other != number
        ]
        seen = [replace(corner, other=facing(number, corner)) for corner in slotted[number]]
        return unit_body(net, number, seen, bodies, settings, file)

    def strains(number: int, slots: Sequence[Slot]) -> list[float]:
        ends = zip(slots, (facing(number, corner) for corner in slotted[number]), strict=True)
        return [slender_strain(slot, end, settings) for slot, end in ends if end is not None]

    for number in order:
        made[number] = place(number)
    for number in order if settings.slots.direction == "ligament" else []:
        before = strains(number, made[number].slots)
        if max(before, default=0.0) <= STRAIGHT:
            continue
        try:
            trial = place(number)
        except UnbuildableUnitError:  # a neighbour has grown into its room: it stays as it is
            continue
        after = strains(number, trial.slots)
        if sum(x * x for x in after) < _BETTER * sum(x * x for x in before):
            made[number] = trial
    return made


def unit_body(
    net: UnitNetwork,
    number: int,
    slotted: Sequence[Corner],
    neighbours: Sequence[Polygon],
    settings: Fabrication,
    file: Path,
) -> UnitBody:
    """Grows a unit as little as its slots need, and places these.

    Args:
        net: the structure.
        number: of the unit.
        slotted: its vertices that take a slot.
        neighbours: bodies of the units around it.
        settings: of the fabrication.
        file: the design dataset, for messages.

    Raises:
        UnbuildableUnitError: a slot has no room.
    """
    design = net.polygons[number]
    plain = filleted(design, settings.fillet_radius)
    if plain.is_empty:
        raise _too_round(net.labels[number], design, settings, file)
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
        truncated = [side_truncations(body, slot, settings) for slot in chosen]
        outline = cut(body, chosen, truncated, settings)
        slots = tuple(
            replace(slot, truncation=max(sides), wall=min(slot.wall, wall(outline, slot)))
            for slot, sides in zip(chosen, truncated, strict=True)
        )
        if all(_is_held(slot, settings) for slot in slots):
            return UnitBody(body, slots, outline)
    fault = _no_slot(net.labels[number], design, failure, settings, file)
    if settings.fillet_radius > 0.0:
        sharp = settings.model_copy(update={"fillet_radius": 0.0})
        try:
            unit_body(net, number, slotted, neighbours, sharp, file)
        except UnbuildableUnitError:
            raise fault from None
        fault = _too_round(net.labels[number], design, settings, file)
    raise fault


def _is_held(slot: Slot, settings: Fabrication) -> bool:
    """Tests that a shim is held long enough, between thick enough walls."""
    grip, least = slot.depth - slot.truncation, settings.slots.depth_min
    return grip >= least - _HAIR and slot.wall >= settings.minimum_wall - _ROUNDING


def _too_round(
    label: str, design: Polygon, settings: Fabrication, file: Path
) -> UnbuildableUnitError:
    value = f"{settings.fillet_radius:g} mm"
    return UnbuildableUnitError(
        f"corners rounded by {value} leave no room for the slots of unit {label}",
        (design,),
        design.exterior,
        file=file,
        key="fabrication.fillet_radius",
        value=value,
        remedy="lower it, or leave it out",
    )


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


def end_angles(net: UnitNetwork, settings: Fabrication, file: Path) -> Floats:
    """Measures the slots of all shims against their ligaments (n_ligaments, 2), rad.

    Args:
        net: the structure.
        settings: of the fabrication.
        file: the design dataset, for messages.

    Raises:
        UnbuildableUnitError: units overlap, ligaments share a vertex, or a slot has no room.
    """
    refuse_faults(net, file)
    made = unit_bodies(net, settings, file)
    slots = {(number, slot.vertex): slot for number in made for slot in made[number].slots}
    pairs = ((slots[one], slots[other]) for _, one, other, _ in net.ligaments)
    return np.array([slot_angles(*pair) for pair in pairs]).reshape(-1, 2)
