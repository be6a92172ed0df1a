"""Builds the specimen of a design: units with slots, ids and dots, and shims."""

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import shapely

from pipeline.fabrication.engraving import orientation_mark, place_id
from pipeline.fabrication.parts import (
    LETTERS,
    SHIM_PLAY,
    BuiltSpecimen,
    Ligament,
    Shim,
    UnbuildableUnitError,
    Unit,
)
from pipeline.fabrication.units.prebend import prebend
from pipeline.fabrication.units.tracking_dots import dots, pin_holes
from pipeline.fabrication.units.unit_bodies import UnitBody, unit_bodies
from pipeline.fabrication.units.unit_network import UnitNetwork, refuse_faults
from pipeline.fabrication.units.unit_outlines import filleted
from pipeline.problem.sections import Fabrication

_HAIR = 1e-6
_STEP = 0.05  # mm, of the lengths of shims


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
        UnbuildableUnitError: units overlap, ligaments share a vertex, a slot or an id has no room,
            a shim is bent too much; names the unit and what to change.
    """
    refuse_faults(net, file)
    units, letters = {}, LETTERS
    for number, body in unit_bodies(net, settings, file).items():
        units[number] = build_unit(net, number, body, settings, file, letters)
        letters = letters.replace(units[number].letter, "", 1)
        done()
    joints = _ligaments(net, units, settings)
    _refuse_bent(joints, units, settings, file)
    clamped, driven = (tuple(net.labels[n] for n in held) for held in (net.clamped, net.driven))
    shims = sort_shims(joints, settings)
    return BuiltSpecimen(*names, tuple(units.values()), joints, shims, clamped, driven)


def build_unit(
    net: UnitNetwork,
    number: int,
    made: UnitBody,
    settings: Fabrication,
    file: Path,
    letters: str = LETTERS,
) -> Unit:
    """Builds a unit.

    Args:
        net: the structure.
        number: of the unit.
        made: its body and its slots.
        settings: of the fabrication.
        file: the design dataset, for messages.
        letters: it carries one of these where there is no room for its id.

    Raises:
        UnbuildableUnitError: its id has no room.
    """
    label, design = net.labels[number], net.polygons[number]
    body, slots, outline = made
    for words in (label, *letters):
        placed = place_id(words, outline, body, settings.labels)
        if placed is not None:
            break
    else:
        what = f"no room for the id of unit {label}"
        remedy = "ask for larger units in the design (constraints.edge_length)"
        key = "fabrication.labels.height"
        raise UnbuildableUnitError(what, (design,), outline, file=file, key=key, remedy=remedy)
    mark = orientation_mark(outline, body, placed, settings.labels)
    written = (*placed.strokes, *mark)
    grown = body.area - filleted(design, settings.fillet_radius).area
    return Unit(
        number,
        label,
        *net.index[number],
        design,
        outline,
        slots,
        placed.strokes,
        mark,
        dots(outline, settings.markers),
        settings.thickness,
        placed.mirrored,
        float(grown) if grown > _HAIR else 0.0,
        "" if words == label else words,
        pin_holes(outline, written, settings) if settings.laminated else (),
    )


def _ligaments(
    net: UnitNetwork, units: dict[int, Unit], settings: Fabrication
) -> tuple[Ligament, ...]:
    """Measures the ligaments between units (by id) as they are built."""
    ligaments = []
    for number, (a, p), (b, q), _ in net.ligaments:
        one, other = (
            next(slot for slot in units[unit].slots if slot.vertex == vertex)
            for unit, vertex in ((a, p), (b, q))
        )
        pair, bent = (net.labels[a], net.labels[b]), prebend(one, other, settings)
        length = round(one.grip + bent.free + other.grip, 4)
        x, y = ((one.mouth + other.mouth) / 2.0).tolist()
        gap = float(np.linalg.norm(other.mouth - one.mouth))
        held = (bent.angles, bent.strain, bent.moment, gap)
        ligaments.append(Ligament(number, pair, length, bent.free, (x, y), *held))
    return tuple(ligaments)


def _refuse_bent(
    ligaments: Sequence[Ligament], units: dict[int, Unit], settings: Fabrication, file: Path
) -> None:
    """Refuses shims that are bent too much before any load; names the worst."""
    worst = max(ligaments, key=lambda ligament: ligament.strain, default=None)
    most = settings.shims.prebend_strain
    if worst is None or worst.strain <= most:
        return
    angles = " and ".join(f"{math.degrees(angle):.0f}" for angle in worst.angles)
    bent = f"is bent to a strain of {100 * worst.strain:.1f} % before any load, by"
    if math.isinf(worst.strain):
        bent = "comes to rest in no shape between"
    raise UnbuildableUnitError(
        f"the shim {worst.name} {bent} slots that are turned {angles} deg from the ligament",
        tuple(unit.outline for unit in units.values() if unit.label in worst.labels),
        shapely.Point(worst.middle),
        file=file,
        key="fabrication.shims.prebend_strain",
        value=most,
        remedy="take a thinner foil (fabrication.shims.thickness), lower fabrication.minimum_wall,"
        " ask for wider corners in the design (constraints.block_angle), or raise it",
    )


def sort_shims(ligaments: Sequence[Ligament], settings: Fabrication) -> tuple[Shim, ...]:
    """Sorts the pieces to cut into the fewest lengths: none is long, or `SHIM_PLAY` short."""
    taken: dict[float, list[int]] = defaultdict(list)
    length = -math.inf
    for ligament in sorted(ligaments, key=lambda ligament: ligament.length):
        if ligament.length > length + SHIM_PLAY:
            length = round(math.floor((ligament.length + _HAIR) / _STEP) * _STEP, 2)
        taken[length].append(ligament.number)
    spares = settings.shims.spares
    return tuple(
        Shim(
            f"S{length:g}",
            length,
            settings.thickness,
            tuple(sorted(taken[length])),
            max(1, math.ceil(spares * len(taken[length]))),
        )
        for length in sorted(taken)
    )


def summary(specimen: BuiltSpecimen) -> str:
    """Sums up a specimen in one line."""
    thickened = sum(unit.thickened > 0.0 for unit in specimen.units)
    lengths = f"{len(specimen.shims)} length{'s' * (len(specimen.shims) != 1)}"
    free = max((ligament.free for ligament in specimen.ligaments), default=0.0)
    strain = 100 * max((ligament.strain for ligament in specimen.ligaments), default=0.0)
    return (
        f"{len(specimen.units)} units ({thickened} thickened beside their slots),"
        f" {sum(shim.count for shim in specimen.shims)} shims of {lengths},"
        f" free up to {free:.2f} mm,"
        f" {len(specimen.bent)} bent before any load, to a strain of {strain:.1f} % at most"
    )
