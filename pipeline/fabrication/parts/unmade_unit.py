"""The error of a unit that cannot be made, with what a picture of it needs."""

from __future__ import annotations

from pathlib import Path

from shapely import Geometry

from pipeline.runtime import UserError


class UnmadeError(UserError):
    """A unit of a design cannot be made.

    Args:
        what: the fault in one sentence, with the unit's label.
        around: outlines to show, mm.
        spot: where the fault is, mm.
        file: the design.
        key: the variable of the design or the dotted parameter.
        remedy: what to change.
        value: of the parameter.
    """

    def __init__(
        self,
        what: str,
        around: tuple[Geometry, ...],
        spot: Geometry,
        *,
        file: Path,
        key: str,
        remedy: str,
        value: object = None,
    ) -> None:
        super().__init__(what, file=file, key=key, value=value, remedy=remedy)
        self.around = around
        self.spot = spot
