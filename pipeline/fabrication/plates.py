"""Printed parts on the plates of a printer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from pipeline.errors import UserError
from pipeline.fabrication.packing import TooLargeError, pack
from pipeline.fabrication.solids import Solid
from pipeline.problem.fabrication import Print


@dataclass(frozen=True)
class Plate:
    """A plate with parts on it.

    Attributes:
        name: of its file.
        parts: each with the lower left corner of its box, mm from the corner of the bed.
    """

    name: str
    parts: tuple[tuple[Solid, float, float], ...]

    @property
    def ids(self) -> list[str]:
        """Ids of the parts."""
        return [solid.id for solid, _, _ in self.parts]


def plates(kind: str, solids: Sequence[Solid], wanted: Print, file: str) -> Iterator[Plate]:
    """The plates of one kind of parts.

    Args:
        kind: what they hold; begins the names of the files.
        solids: the parts.
        wanted: bed, margin, gap.
        file: of the problem, for messages.

    Raises:
        UserError: a part is larger than the bed.
    """
    try:
        spots = pack([solid.size for solid in solids], wanted.bed, wanted.margin, wanted.gap)
    except TooLargeError as error:
        raise _too_large(solids[error.part], wanted, file) from error
    for number in range(max((spot.sheet for spot in spots), default=-1) + 1):
        yield Plate(
            f"{kind}_plate{number + 1}",
            tuple((solids[spot.part], spot.x, spot.y) for spot in spots if spot.sheet == number),
        )


def _too_large(solid: Solid, wanted: Print, file: str) -> UserError:
    width, depth = solid.size
    room = [side - 2 * wanted.margin for side in wanted.bed]
    return UserError(
        f"part {solid.id} of {width:.1f} x {depth:.1f} mm does not fit on a bed with"
        f" {room[0]:g} x {room[1]:g} mm inside its margin",
        file=file,
        key="fabrication.print.bed",
        value=[f"{side:g} mm" for side in wanted.bed],
        remedy="give the size of a larger bed, or a smaller margin",
    )
