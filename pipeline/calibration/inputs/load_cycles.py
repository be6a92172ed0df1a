"""Describes records of load cycles, and the path that a simulated unit is driven along."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pipeline.calibration.inputs.description import ForceColumns, Label, Specimen
from pipeline.calibration.inputs.population import MeasurementSource
from pipeline.problem.fields import File, Gap, Section, fault
from pipeline.problem.sections import Contact, NumericConstants

Unit = Annotated[int, Field(ge=0, strict=True)]


class PathDrive(Section):
    """Moves one unit along a path without turning it, while another one is held.

    Attributes:
        held: number of the unit that is clamped.
        driven: number of the one that moves.
        file: a CSV with columns ux, uy (of the driven unit, from rest) and approach (of the
            machine's clamps), each with its unit.
    """

    held: Unit
    driven: Unit
    file: File

    @model_validator(mode="after")
    def _check_units(self) -> Self:
        if self.held == self.driven:
            what = "the unit that moves is held"
            raise fault(what, "give the numbers of two units", "driven")
        return self


class CycleRecord(Section):
    """The record of a testing machine over several cycles.

    Attributes:
        name: of the record.
        title: in words.
        file: a CSV with a heading.
        columns: of the file.
        first: whether the first cycle counts as well; by default only where it is alone.
        material: of the simulation by the drive; without it there is none.
        contact: likewise.
        play: of the clamps: by so much they move while they transmit no force.
        known: a CSV of what others computed, with columns approach (mm), and the slope of the
            energy over it (N): equilibrium (differences over two steps), and motion (in time).
    """

    name: Label
    title: str
    file: File
    columns: ForceColumns = ForceColumns()
    first: Literal["dropped", "kept"] = "dropped"
    material: NumericConstants | None = None
    contact: Contact | None = None
    play: Gap = 0.0
    known: File | None = None

    @model_validator(mode="after")
    def _check_simulated(self) -> Self:
        if self.contact is not None and self.contact.law != "angle":
            remedy = "give contact of law: angle, or none"
            raise fault("contact by the law of distance is not known here", remedy, "contact")
        for name in ("contact", "known"):
            if self.material is None and getattr(self, name) is not None:
                what = f"{name} is of the simulation, and there is none without material"
                raise fault(what, "give material, or leave it out", name)
        return self


class LoadCycles(Section):
    """Load cycles of one make of specimen.

    Attributes:
        title: one line about them.
        doc: more lines.
        source: who measured.
        lattice: of the specimens.
        drive: of those that are simulated.
        records: all of them.
    """

    title: str = ""
    doc: str = ""
    source: MeasurementSource
    lattice: Specimen
    drive: PathDrive
    records: Annotated[tuple[CycleRecord, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _check_lattice(self) -> Self:
        count = self.lattice.n_units
        for name in ("held", "driven"):
            if (unit := getattr(self.drive, name)) >= count:
                what = f"no unit {unit}: the lattice has {count}, numbered from 0"
                raise fault(what, f"give a number of at most {count - 1}", "drive", name)
        return self
