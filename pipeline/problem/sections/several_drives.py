"""Describes drives of different units that act at once."""

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pipeline.problem.fields import Section, fault
from pipeline.problem.sections.drives import SingleDrive


class SeveralDrives(Section):
    """Drives of different units that act at once.

    In a problem file they may stand as a list under `drives`, in place of `drive`.

    Attributes:
        kind: which of the drives this is.
        drives: each with one direction, or with one for each load case.
    """

    kind: Literal["several"]
    drives: Annotated[
        tuple[Annotated[SingleDrive, Field(discriminator="kind")], ...], Field(min_length=1)
    ]

    @property
    def directions(self) -> tuple[float, ...]:
        """Lists the direction of the first drive in every load case."""
        found: tuple[float, ...] = getattr(self.drives[0], "directions", (0.0,))
        return found if len(found) > 1 else found * len(self.case_weights)

    @property
    def case_weights(self) -> tuple[float, ...]:
        """Computes the weight of each load case in the loss: those that a drive gives, or equal."""
        given = self._given_weights
        return given[0] if given else max((each.case_weights for each in self.drives), key=len)

    @property
    def _given_weights(self) -> list[tuple[float, ...]]:
        """Lists the different weights that drives of several directions give."""
        words = (getattr(drive, "weights", None) for drive in self.drives)
        return list(dict.fromkeys(each for each in words if each is not None and len(each) > 1))

    @model_validator(mode="after")
    def _cases_agree(self) -> Self:
        counts = {len(drive.case_weights) for drive in self.drives} - {1}
        if len(counts) > 1:
            what = f"drives of {' and '.join(map(str, sorted(counts)))} directions act at once"
            raise fault(what, "give each one direction, or as many as the others", "drives")
        if len(given := self._given_weights) > 1:
            what = f"the load cases have weights {given[0]} by one drive and {given[1]} by another"
            raise fault(what, "give the weights once: the drives share their load cases", "drives")
        return self


Drive = Annotated[SingleDrive | SeveralDrives, Field(discriminator="kind")]


def read_several(data: object) -> object:
    """Reads a list under `drives`, of a section that has a `drive`, as a drive of several at once.

    Raises:
        PydanticCustomError: the section has both, or a list in the wrong place.
    """
    if not isinstance(data, Mapping):
        return data
    if isinstance(data.get("drive"), list):
        remedy = "write them below it, or several drives in a list under `drives`"
        raise fault("keys and values are wanted here", remedy, "drive")
    if "drives" not in data:
        return data
    if "drive" in data:
        raise fault("drive and drives exclude each other", "give one of them", "drives")
    others = {key: value for key, value in data.items() if key != "drives"}
    return {**others, "drive": {"kind": "several", "drives": data["drives"]}}


def single_drives(drive: SingleDrive | SeveralDrives) -> tuple[SingleDrive, ...]:
    """Lists the drives that act at once."""
    return drive.drives if isinstance(drive, SeveralDrives) else (drive,)
