"""From a design to the specimen that is built: units with slots, ids and dots, and shims."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
import xarray as xr
from shapely import Polygon

from pipeline.errors import UserError
from pipeline.fabrication import lettering, markers, outlines, slots
from pipeline.fabrication.parts import Floats, Ligament, Shim, Slot, Specimen, Unit, labels
from pipeline.fabrication.slots import Corner, NoRoomError
from pipeline.problem.fabrication import Fabrication

_STAGES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the most that a unit may grow
_NEAR = 3.0  # mm; farther neighbours never matter
_HAIR = 1e-6
_ROUNDING = 1e-3  # mm, of outlines as they are made


@dataclass(frozen=True)
class Network:
    """One structure of a design: what is there, before anything is made of it.

    Attributes:
        numbers: (n,) ids of the units that are present.
        polygons: as designed, by id.
        labels: by id.
        index: (i, j) by id.
        ligaments: (id, (unit, vertex), (unit, vertex), unit vector from the first to the second).
        clamped, driven: ids.
    """

    numbers: tuple[int, ...]
    polygons: dict[int, Polygon]
    labels: dict[int, str]
    index: dict[int, tuple[int, int]]
    ligaments: tuple[tuple[int, tuple[int, int], tuple[int, int], Floats], ...]
    clamped: tuple[int, ...]
    driven: tuple[int, ...]


def network(design: xr.Dataset, structure: str) -> Network:
    """The structure "intact", "altered" or "cloaked" of a design."""
    vertices = design["vertices" if structure == "cloaked" else "vertices_initial"]
    shapes = vertices.transpose("unit", "vertex", "xy").values
    present = np.isfinite(shapes[:, :3]).all(axis=(1, 2))
    if structure != "intact":
        present &= design["region"].values != _flag(design["region"], "void")
    ids = design["unit"].values
    index = list(zip(design["i"].values.tolist(), design["j"].values.tolist(), strict=True))
    names = labels(index)
    ends = zip(design["ligament_unit"].values, design["ligament_vertex"].values, strict=True)
    row = {int(number): at for at, number in enumerate(ids)}
    joined = []
    for number, ((a, b), (p, q)) in enumerate(ends):
        if present[row[int(a)]] and present[row[int(b)]]:
            vector = shapes[row[int(b)], q] - shapes[row[int(a)], p]
            along = vector / np.linalg.norm(vector)
            joined.append((number, (int(a), int(p)), (int(b), int(q)), along))
    support = design["support"].values
    there = np.flatnonzero(present)
    return Network(
        tuple(int(ids[at]) for at in there),
        {int(ids[at]): _polygon(shapes[at]) for at in there},
        {int(ids[at]): names[at] for at in there},
        {int(ids[at]): index[at] for at in there},
        tuple(joined),
        tuple(int(ids[at]) for at in there if support[at] == _flag(design["support"], "clamped")),
        tuple(int(ids[at]) for at in there if support[at] == _flag(design["support"], "driven")),
    )


def _flag(variable: xr.DataArray, meaning: str) -> int:
    meanings = variable.attrs["flag_meanings"].split()
    return int(variable.attrs["flag_values"][meanings.index(meaning)])


def _polygon(points: Floats) -> Polygon:
    return Polygon(points[np.isfinite(points).all(axis=1)])


def specimen(
    net: Network,
    wanted: Fabrication,
    names: tuple[str, str],
    file: Path,
    done: Callable[[], None] = lambda: None,
) -> Specimen:
    """What is built of a structure.

    Args:
        net: the structure.
        wanted: how it is made.
        names: of the study and of the structure.
        file: the design dataset, for messages.
        done: called after each unit.

    Raises:
        UserError: units overlap, a slot or an id has no room; names the unit and what to change.
    """
    _refuse_overlaps(net, file)
    corners = _corners(net)
    bodies = dict(net.polygons)  # grows as units are thickened
    order = list(net.numbers)
    tree = shapely.STRtree([net.polygons[number] for number in order])
    units = []
    for number in order:
        near = tree.query(net.polygons[number], "dwithin", _NEAR)
        neighbours = [bodies[order[at]] for at in near if order[at] != number]
        unit, bodies[number] = _unit(net, number, corners[number], neighbours, wanted, file)
        units.append(unit)
        done()
    ligaments = tuple(_ligaments(net, {unit.number: unit for unit in units}))
    return Specimen(
        *names,
        tuple(units),
        ligaments,
        shims(ligaments, wanted),
        tuple(net.labels[number] for number in net.clamped),
        tuple(net.labels[number] for number in net.driven),
    )


def _refuse_overlaps(net: Network, file: Path) -> None:
    polygons = [net.polygons[number] for number in net.numbers]
    for number, polygon in zip(net.numbers, polygons, strict=True):
        if not polygon.is_valid or not polygon.exterior.is_ccw:
            remedy = "design it with constraints on edges and angles"
            what = f"the outline of unit {net.labels[number]} crosses itself"
            raise UserError(what, file=file, key="vertices", remedy=remedy)
    tree = shapely.STRtree(polygons)
    for first, second in tree.query(polygons, "intersects").T:
        if first < second and polygons[first].intersection(polygons[second]).area > _HAIR:
            pair = " and ".join(net.labels[net.numbers[at]] for at in (first, second))
            what = f"the units {pair} overlap in the design"
            remedy = 'ask for a gap in the design, e.g. constraints.gap: "0.2 mm"'
            raise UserError(what, file=file, key="vertices", remedy=remedy)


def _corners(net: Network) -> dict[int, list[Corner]]:
    found: dict[int, list[Corner]] = defaultdict(list)
    for number, (a, p), (b, q), along in net.ligaments:
        found[a].append(Corner(p, number, -along))
        found[b].append(Corner(q, number, along))
    return found


def _unit(
    net: Network,
    number: int,
    corners: Sequence[Corner],
    neighbours: Sequence[Polygon],
    wanted: Fabrication,
    file: Path,
) -> tuple[Unit, Polygon]:
    """A unit as made, and its body without slots."""
    label, design = net.labels[number], net.polygons[number]
    body, cuts = _body(design, corners, neighbours, wanted, label, file)
    outline = outlines.cut(body, cuts, wanted)
    written = lettering.fitted(label, outline, body, wanted.labels)
    if written is None:
        what = f"no room for the id of unit {label}"
        remedy = "ask for larger units in the design (constraints.edge_length)"
        raise UserError(what, file=file, key="fabrication.labels.height", remedy=remedy)
    arrow = lettering.mark(outline, body, written.box, wanted.labels)
    dots = markers.dots(outline, wanted.markers)
    grown = body.area - outlines.filleted(design, wanted.fillet_radius).area
    unit = Unit(
        number,
        label,
        *net.index[number],
        design,
        outline,
        cuts,
        written.strokes,
        arrow,
        dots,
        wanted.thickness,
        written.mirrored,
        float(grown) if grown > _HAIR else 0.0,
    )
    return unit, body


def _body(
    design: Polygon,
    corners: Sequence[Corner],
    neighbours: Sequence[Polygon],
    wanted: Fabrication,
    label: str,
    file: Path,
) -> tuple[Polygon, tuple[Slot, ...]]:
    """The unit before its slots are cut, and the slots."""
    plain = outlines.filleted(design, wanted.fillet_radius)
    failure = NoRoomError(None, 0.0)
    for share in _STAGES if wanted.slots.thicken > 0.0 else _STAGES[:1]:
        room = plain
        if share > 0.0:
            growth = share * wanted.slots.thicken
            room = outlines.room_to_grow(plain, neighbours, growth, wanted)
        try:
            chosen = slots.place(design, corners, wanted, room)
        except NoRoomError as error:
            failure = error
            continue
        body = outlines.lugs(plain, room, chosen, wanted) if share > 0.0 else plain
        held = _measured(body, chosen, wanted)
        if all(_holds(slot, wanted) for slot in held):
            return body, held
    raise _no_slot(label, failure, wanted, file)


def _measured(body: Polygon, chosen: Sequence[Slot], wanted: Fabrication) -> tuple[Slot, ...]:
    """The slots with their truncations and walls in the body as it is made."""
    made = outlines.cut(body, chosen, wanted)
    return tuple(
        replace(
            slot,
            truncation=max(slots.side_truncations(body, slot, wanted)),
            wall=min(slot.wall, outlines.wall(made, slot)),
        )
        for slot in chosen
    )


def _holds(slot: Slot, wanted: Fabrication) -> bool:
    """Whether a shim is held long enough, between thick enough walls."""
    grip = slot.depth - slot.truncation
    return grip >= wanted.slots.depth_min - _HAIR and slot.wall >= wanted.minimum_wall - _ROUNDING


def _no_slot(label: str, failure: NoRoomError, wanted: Fabrication, file: Path) -> UserError:
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
    return UserError(
        what,
        file=file,
        key="fabrication.minimum_wall",
        value=f"{wanted.minimum_wall:g} mm",
        remedy=remedy,
    )


def _ligaments(net: Network, units: dict[int, Unit]) -> list[Ligament]:
    made = []
    for number, (a, p), (b, q), along in net.ligaments:
        one, other = (
            next(slot for slot in units[unit].slots if slot.vertex == vertex)
            for unit, vertex in ((a, p), (b, q))
        )
        gap = float(np.linalg.norm(other.mouth - one.mouth))
        bend = _angle(-one.direction, along) + _angle(along, other.direction)
        pair = (net.labels[a], net.labels[b])
        length = round(gap + one.depth + other.depth, 4)
        free = gap + one.truncation + other.truncation
        made.append(Ligament(number, pair, length, free, bend))
    return made


def _angle(first: Floats, second: Floats) -> float:
    cross = first[0] * second[1] - first[1] * second[0]
    return abs(float(np.arctan2(cross, first @ second)))


def shims(ligaments: Sequence[Ligament], wanted: Fabrication) -> tuple[Shim, ...]:
    """The pieces to cut, one kind for each length."""
    taken: dict[float, list[int]] = defaultdict(list)
    for ligament in ligaments:
        taken[ligament.length].append(ligament.number)
    return tuple(
        Shim(
            f"S{length:g}",
            length,
            wanted.thickness,
            tuple(taken[length]),
            max(1, math.ceil(wanted.shims.spares * len(taken[length]))),
        )
        for length in sorted(taken)
    )


def summary(made: Specimen) -> str:
    """What is built, in one line."""
    thickened = sum(unit.thickened > 0.0 for unit in made.units)
    free = max((ligament.free for ligament in made.ligaments), default=0.0)
    bend = math.degrees(max((ligament.bend for ligament in made.ligaments), default=0.0))
    return (
        f"{len(made.units)} units ({thickened} thickened beside their slots),"
        f" {sum(shim.count for shim in made.shims)} shims of {len(made.shims)} lengths,"
        f" free up to {free:.2f} mm, bent up to {bend:.0f} deg"
    )
