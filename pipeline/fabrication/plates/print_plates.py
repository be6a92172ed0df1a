"""Printed parts on the plates of a printer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from pipeline.fabrication.parts import PrintedPart
from pipeline.fabrication.plates.packing import Ground, spread
from pipeline.problem.sections import Print


@dataclass(frozen=True)
class Plate:
    """A plate with parts on it.

    Attributes:
        name: of its file.
        parts: each with the lower left corner of its box, mm from the corner of the bed.
    """

    name: str
    parts: tuple[tuple[PrintedPart, float, float], ...]

    @property
    def ids(self) -> list[str]:
        """Ids of the parts."""
        return [solid.id for solid, _, _ in self.parts]


def plates(kind: str, solids: Sequence[PrintedPart], wanted: Print, file: str) -> Iterator[Plate]:
    """The plates of one kind of parts.

    Args:
        kind: what they hold; begins the names of the files.
        solids: the parts.
        wanted: bed, margin, gap.
        file: of the problem, for messages.

    Raises:
        UserError: a part is larger than the bed.
    """
    bed = Ground("bed", "print", wanted.bed, wanted.margin, wanted.gap)
    for number, parts in enumerate(spread(solids, bed, file), 1):
        yield Plate(f"{kind}_plate{number}", parts)
