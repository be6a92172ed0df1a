"""The authors' continuous strips: one along each row of units and one along each column."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from shapely import box

from pipeline.fabrication.parts import Floats, Ligament, Part, Specimen
from pipeline.problem.fabrication import Fabrication

_MARGIN = 0.5  # mm of a strip beyond a line to fold along


class _Step(NamedTuple):
    """A ligament as a step of a strip: to be sorted by the place of its first unit."""

    place: int
    ends: tuple[str, str]
    points: Floats


def strips(specimen: Specimen) -> Iterator[tuple[str, Floats]]:
    """The paths of the strips; a row or a column that a void interrupts has several.

    A path goes from slot end to slot end: out of a unit through the mouth of its slot, along the
    ligament, into the next unit, and across it.

    Yields:
        Name, and points (n, 2) in the specimen frame.
    """
    lines: dict[tuple[str, int], list[_Step]] = defaultdict(list)
    for line, step in _steps(specimen):
        lines[line].append(step)
    for (kind, number), steps in sorted(lines.items()):
        pieces = list(_unbroken(sorted(steps, key=lambda step: step.place)))
        for piece, found in enumerate(pieces, 1):
            name = f"{kind}{number}" + (f"-{piece}" if len(pieces) > 1 else "")
            yield name, np.concatenate([step.points for step in found])


def _steps(specimen: Specimen) -> Iterator[tuple[tuple[str, int], _Step]]:
    """Each ligament with the row or the column that it belongs to."""
    ends = {
        (slot.ligament, unit.label): np.stack([slot.end, slot.mouth])
        for unit in specimen.units
        for slot in unit.slots
    }
    for ligament in specimen.ligaments:
        pair = _ascending(specimen, ligament)
        one, other = (specimen.by_label[label] for label in pair)
        inwards, outwards = (ends[ligament.number, label] for label in pair)
        points = np.concatenate([inwards, outwards[::-1]])
        along_row = one.row == other.row
        line = ("ROW", one.row + 1) if along_row else ("COLUMN", one.column + 1)
        yield line, _Step(one.column if along_row else one.row, pair, points)


def _ascending(specimen: Specimen, ligament: Ligament) -> tuple[str, str]:
    one, other = (specimen.by_label[label] for label in ligament.labels)
    first, second = sorted((one, other), key=lambda unit: (unit.row, unit.column))
    return first.label, second.label


def _unbroken(steps: Iterable[_Step]) -> Iterator[list[_Step]]:
    """Runs of steps each of which begins at the unit where the one before ends."""
    run: list[_Step] = []
    for step in steps:
        if run and run[-1].ends[1] != step.ends[0]:
            yield run
            run = []
        run.append(step)
    yield run


def strip_parts(specimen: Specimen, wanted: Fabrication) -> Sequence[Part]:
    """The strips laid flat: their length, and lines where they enter and leave the units."""
    made = []
    for name, points in strips(specimen):
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        folds = tuple(
            np.array([[x, _MARGIN], [x, wanted.thickness - _MARGIN]]) for x in along[1:-1].tolist()
        )
        outline = box(0.0, 0.0, float(along[-1]), wanted.thickness)
        made.append(Part(name, outline, wanted.shims.thickness, scores=folds))
    return made
