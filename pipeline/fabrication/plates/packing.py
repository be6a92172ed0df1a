"""Packs parts side by side on sheets and plates: shelves of parts that go down in height."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, TypeVar

from pipeline.fabrication.parts import FlatPart, PrintedPart
from pipeline.runtime import UserError

_HAIR = 1e-9  # mm

P = TypeVar("P", FlatPart, PrintedPart)


class Spot(NamedTuple):
    """Holds the place of the lower left corner of a part's box."""

    part: int  # its place in the sequence of parts
    sheet: int  # number of the sheet, from zero
    x: float  # mm from the lower left corner of the sheet
    y: float  # likewise


class TooLargeError(ValueError):
    """Reports a part, by its place in the sequence, that is larger than the room on a sheet."""

    def __init__(self, part: int) -> None:
        super().__init__(f"part {part} is larger than a sheet")
        self.part = part


class Ground(NamedTuple):
    """Describes the sheet or bed that parts are laid on."""

    name: str  # sheet or bed; also that of the parameter
    section: str  # of the parameters of fabrication
    size: tuple[float, float]  # width and height, mm
    margin: float  # free rim
    gap: float  # least distance of two parts


def pack(
    sizes: Sequence[tuple[float, float]], sheet: tuple[float, float], margin: float, gap: float
) -> list[Spot]:
    """Packs parts on sheets, as they are turned; the spots are in the order of the parts.

    Args:
        sizes: width and height of each part, mm.
        sheet: width and height of a sheet.
        margin: free rim.
        gap: least distance of two parts.

    Raises:
        TooLargeError: a part is larger than the room on a sheet.
    """
    room, reach = (side - 2 * margin for side in sheet)
    spots: dict[int, Spot] = {}
    shelves: list[list[float]] = []  # sheet, y, height, x of the next part
    number, top = 0, 0.0  # of the last sheet, and how far up it is taken
    for part in sorted(range(len(sizes)), key=lambda part: (-round(sizes[part][1], 3), part)):
        width, height = sizes[part]
        if width > room + _HAIR or height > reach + _HAIR:
            raise TooLargeError(part)
        for shelf in shelves:
            if height <= shelf[2] + _HAIR and shelf[3] + width <= room + _HAIR:
                break
        else:
            if top + height > reach + _HAIR:
                number, top = number + 1, 0.0
            shelf = [number, top, height, 0.0]
            shelves.append(shelf)
            top += height + gap
        spots[part] = Spot(part, int(shelf[0]), margin + shelf[3], margin + shelf[1])
        shelf[3] += width + gap
    return [spots[part] for part in range(len(sizes))]


def spread(
    parts: Sequence[P], ground: Ground, file: str
) -> Iterator[tuple[tuple[P, float, float], ...]]:
    """Spreads parts over sheets or plates, each with the place of its lower left corner.

    Raises:
        UserError: a part is larger than a sheet; names it, `file` and the parameter.
    """
    try:
        spots = pack([part.size for part in parts], ground.size, ground.margin, ground.gap)
    except TooLargeError as error:
        part = parts[error.part]
        width, height = part.size
        room = [side - 2 * ground.margin for side in ground.size]
        raise UserError(
            f"part {part.id} of {width:.1f} x {height:.1f} mm does not fit on a {ground.name} with"
            f" {room[0]:g} x {room[1]:g} mm inside its margin",
            file=file,
            key=f"fabrication.{ground.section}.{ground.name}",
            value=[f"{side:g} mm" for side in ground.size],
            remedy=f"give the size of a larger {ground.name}, or a smaller margin",
        ) from error
    for number in range(max((spot.sheet for spot in spots), default=-1) + 1):
        yield tuple((parts[spot.part], spot.x, spot.y) for spot in spots if spot.sheet == number)
