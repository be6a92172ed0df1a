"""Parts side by side on sheets and plates: shelves of parts that go down in height."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol, TypeVar

from pipeline.runtime import UserError

_HAIR = 1e-9  # mm


class Spot(NamedTuple):
    """Where the lower left corner of a part's box goes.

    Attributes:
        part: its place in the sequence of parts.
        sheet: number of the sheet, from zero.
        x, y: mm from the lower left corner of the sheet.
    """

    part: int
    sheet: int
    x: float
    y: float


class TooLargeError(ValueError):
    """A part is larger than the room on a sheet.

    Attributes:
        part: its place in the sequence of parts.
    """

    def __init__(self, part: int) -> None:
        super().__init__(f"part {part} is larger than a sheet")
        self.part = part


@dataclass
class _Shelf:
    sheet: int
    y: float
    height: float
    x: float


@dataclass
class _Stock:
    """The sheets so far: shelves, and how far up the last sheet is taken."""

    width: float
    height: float
    gap: float
    shelves: list[_Shelf] = field(default_factory=list)
    sheets: int = 1
    top: float = 0.0

    def shelf_for(self, width: float, height: float) -> _Shelf:
        """The first shelf with room, or a new one."""
        for shelf in self.shelves:
            if height <= shelf.height + _HAIR and shelf.x + width <= self.width + _HAIR:
                return shelf
        if self.top + height > self.height + _HAIR:
            self.sheets, self.top = self.sheets + 1, 0.0
        shelf = _Shelf(self.sheets - 1, self.top, height, 0.0)
        self.shelves.append(shelf)
        self.top += height + self.gap
        return shelf


def pack(
    sizes: Sequence[tuple[float, float]], sheet: tuple[float, float], margin: float, gap: float
) -> list[Spot]:
    """Spots of parts on sheets, as they are turned, in the order of the parts.

    Args:
        sizes: width and height of each part, mm.
        sheet: width and height of a sheet.
        margin: free rim.
        gap: least distance of two parts.

    Raises:
        TooLargeError: a part is larger than the room on a sheet.
    """
    stock = _Stock(sheet[0] - 2 * margin, sheet[1] - 2 * margin, gap)
    spots: list[Spot | None] = [None] * len(sizes)
    for part in sorted(range(len(sizes)), key=lambda part: (-round(sizes[part][1], 3), part)):
        width, height = sizes[part]
        if width > stock.width + _HAIR or height > stock.height + _HAIR:
            raise TooLargeError(part)
        shelf = stock.shelf_for(width, height)
        spots[part] = Spot(part, shelf.sheet, margin + shelf.x, margin + shelf.y)
        shelf.x += width + gap
    return [spot for spot in spots if spot is not None]


class Sized(Protocol):
    """Anything that is laid down flat."""

    @property
    def id(self) -> str:
        """Its name."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of its box, mm."""


P = TypeVar("P", bound=Sized)


class Ground(NamedTuple):
    """What parts are laid on.

    Attributes:
        name: sheet or bed; also that of the parameter.
        section: of the parameters of fabrication.
        size: width and height, mm.
        margin: free rim.
        gap: least distance of two parts.
    """

    name: str
    section: str
    size: tuple[float, float]
    margin: float
    gap: float


def spread(
    parts: Sequence[P], ground: Ground, file: str
) -> Iterator[tuple[tuple[P, float, float], ...]]:
    """The parts on as many sheets or plates as it takes, each with its lower left corner.

    Raises:
        UserError: a part is larger than a sheet; names it, `file` and the parameter.
    """
    try:
        spots = pack([part.size for part in parts], ground.size, ground.margin, ground.gap)
    except TooLargeError as error:
        raise _too_large(parts[error.part], ground, file) from error
    for number in range(max((spot.sheet for spot in spots), default=-1) + 1):
        yield tuple((parts[spot.part], spot.x, spot.y) for spot in spots if spot.sheet == number)


def _too_large(part: Sized, ground: Ground, file: str) -> UserError:
    width, height = part.size
    room = [side - 2 * ground.margin for side in ground.size]
    return UserError(
        f"part {part.id} of {width:.1f} x {height:.1f} mm does not fit on a {ground.name} with"
        f" {room[0]:g} x {room[1]:g} mm inside its margin",
        file=file,
        key=f"fabrication.{ground.section}.{ground.name}",
        value=[f"{side:g} mm" for side in ground.size],
        remedy=f"give the size of a larger {ground.name}, or a smaller margin",
    )
