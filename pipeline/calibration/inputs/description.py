"""Describes a calibration: the wanted constants and the measurements."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, StringConstraints, model_validator

from pipeline.calibration.inputs.computed_measurements import (
    Amplitude,
    ComputedMeasurements,
    PoseError,
    VirtualDecay,
    VirtualForces,
    VirtualTrack,
)
from pipeline.problem.fields import Count, File, Force, Length, Section, exactly_one, fault
from pipeline.problem.sections import Contact, Lattice, ListedNetwork, NumericConstants

ConstantName = Literal[
    "axial_stiffness",
    "shear_stiffness",
    "bending_stiffness",
    "damping_ratio",
    "damping_translation",
    "damping_rotation",
    "contact_cutoff",
]

TestKind = Literal["tension", "compression", "shear"]


def _check_same_stiffness(lattice: Lattice) -> Lattice:
    """Refuses ligaments with stiffnesses of their own: all are made of the same constants here."""
    listed = (isinstance(lattice, ListedNetwork) and lattice.stiffnesses) or ()
    if any(value is not None for own in listed for value in own):
        what = "the file gives ligaments stiffnesses of their own, and all have the same ones here"
        raise fault(what, "leave those columns out of the file", "file")
    return lattice


Specimen = Annotated[Lattice, AfterValidator(_check_same_stiffness)]
"""Lattice whose ligaments are all of the same constants."""
Label = Annotated[str, StringConstraints(pattern=r"^\w+$")]


class ForceColumns(Section):
    """Names of the columns; their units stand in brackets behind them in the file.

    Attributes:
        displacement: of the top row.
        force: on it.
    """

    displacement: str = "displacement"
    force: str = "force"


class RecordOptions(Section):
    """Tells how a machine's record is cut before the fit.

    Attributes:
        branch: of each cycle that is taken.
        reversed: what the machine counts the other way than the test's direction; of a track the
            force alone can be.
        drop_first: leaves out the first cycle.
        zero: of displacement and force: as they are, or their means over the first twentieth of
            each branch's way.
        toe: force by which the slack is taken up, at least 4 times the noise; the displacement then
            counts from where the line fitted from that force to twice as much meets zero, and what
            is before is left out.
    """

    branch: Literal["all", "loading", "unloading"] = "loading"
    reversed: Literal["displacement", "force", "both"] | None = None
    drop_first: bool = False
    zero: Literal["file", "start"] = "file"
    toe: Force | None = None


def check_reversed(file: str | None, record: RecordOptions | None) -> None:
    """Refuses to turn the displacement of a track, which counts in the test's direction."""
    turned = record is not None and record.reversed in ("displacement", "both")
    if turned and file is not None and file.endswith(".nc"):
        what = "a track's displacement counts in the test's direction"
        remedy = "write reversed: force, if the load cell counts the other way, or leave it out"
        raise fault(what, remedy, "record", "reversed")


class ForceDisplacement(Section):
    """Force over displacement of a lattice whose bottom row is clamped and whose top row moves.

    Attributes:
        name: of the set.
        file: a CSV with a heading, as seen from this file; or a track (.nc) with a load cell, of
            which the top row's way from the bottom row is taken.
        virtual: how it is computed, in place of a file.
        lattice: the specimen.
        test: where the top row moves to; displacement and force count positive that way.
        columns: of the file.
        record: where the file is a machine's record: how it is cut; without it all lines count.
        noise: standard deviation of the forces; estimated where it is not given.
        tare: whether the load cell's zero is unknown.
    """

    kind: Literal["force_displacement"]
    name: Label
    file: File | None = None
    virtual: VirtualForces | None = None
    lattice: Specimen
    test: TestKind
    columns: ForceColumns = ForceColumns()
    record: RecordOptions | None = None
    noise: Force | None = None
    tare: bool = False

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        exactly_one(self, "file", "virtual")
        check_reversed(self.file, self.record)
        return self


class DecayColumns(Section):
    """Names of the columns; their units stand in brackets behind them in the file.

    Attributes:
        time: of the readings.
        angle: between the units.
    """

    time: str = "time"
    angle: str = "angle"


class FreeDecay(Section):
    """Angle over time of two units, both hanging free, on one ligament that was bent and let go.

    Attributes:
        name: of the set.
        file: a CSV with a heading, as seen from this file.
        virtual: how it is computed, in place of a file.
        columns: of the file.
        noise: standard deviation of the angles; estimated where it is not given.
    """

    kind: Literal["free_decay"]
    name: Label
    file: File | None = None
    virtual: VirtualDecay | None = None
    columns: DecayColumns = DecayColumns()
    noise: Amplitude | None = None

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        exactly_one(self, "file", "virtual")
        return self


class LoadCellOptions(Section):
    """A load cell that was read during a recording, along the drive of a static load case.

    Attributes:
        noise: standard deviation of the forces; where the tracker's uncertainties are ratios only,
            it is one to them, too.
        tare: whether the cell's zero is unknown.
    """

    noise: Annotated[Force, Field(gt=0.0)]
    tare: bool = False


class TrackedMotion(Section):
    """The motion of a whole specimen, as the stage `track` writes it.

    Attributes:
        name: of the set.
        file: the track, as seen from this file.
        virtual: how it is computed, in place of a file.
        problem: of the study that was filmed, likewise.
        preset: of the problem.
        structure: which of the study's structures it is.
        case: number of the study's load case; for what is computed, and for the load cell.
        every: takes every so many frames.
        noise: whether the tracker's uncertainties hold, or only their ratios do.
        bias: standard deviation of what stays with a unit through all frames (registration); where
            it is not given, each unit's is unknown and nothing is learnt from its mean place.
        load: the load cell whose readings are in the track; without it they are left out.
    """

    kind: Literal["track"]
    name: Label
    file: File | None = None
    virtual: VirtualTrack | None = None
    problem: File
    preset: str | None = None
    structure: Literal["intact", "altered", "cloaked"] = "cloaked"
    case: Annotated[int, Field(ge=0, strict=True)] = 0
    every: Count = 1
    noise: Literal["tracker", "estimated"] = "estimated"
    bias: PoseError | None = None
    load: LoadCellOptions | None = None

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        exactly_one(self, "file", "virtual")
        if self.virtual is not None and self.structure == "cloaked":
            remedy = "give intact or altered"
            raise fault("a cloaked structure cannot be computed here", remedy, "structure")
        return self


MeasurementSet = Annotated[
    ForceDisplacement | FreeDecay | TrackedMotion, Field(discriminator="kind")
]


class Calibration(Section):
    """Constants that are wanted, and the measurements to find them from.

    Attributes:
        title: one line about it.
        doc: more lines.
        spacing: of the lattice, for the authors' law of damping.
        material: values to start from; those that are not wanted stay as they are.
        contact: of neighbouring units in the tests of forces; without it there is none.
        fit: the wanted constants.
        data: what was measured; all sets are fitted together.
        virtual: what data are computed with.
        synthetic: whether the data were computed, not measured.
    """

    title: str = ""
    doc: str = ""
    spacing: Length
    material: NumericConstants
    contact: Contact | None = None
    fit: Annotated[tuple[ConstantName, ...], Field(min_length=1)]
    data: Annotated[tuple[MeasurementSet, ...], Field(min_length=1)]
    virtual: ComputedMeasurements | None = None
    synthetic: bool = False

    @model_validator(mode="after")
    def _check_consistency(self) -> Self:
        for what, remedy, key in _find_faults(self):
            raise fault(what, remedy, *key.split("."))
        return self


def _find_faults(asked: Calibration) -> list[tuple[str, str, str]]:
    """Checks the sections against one another: fault, remedy, key."""
    found = []
    names = [each.name for each in asked.data]
    if len(set(names)) < len(names):
        found.append(("two sets have one name", "name them apart", "data"))
    if len(set(asked.fit)) < len(asked.fit):
        found.append(("a constant is named twice", "name each once", "fit"))
    by_ratio, both = asked.material.damping.ratio is not None, {"translation", "rotation"}
    wanted = {"ratio"} if by_ratio else both
    unknown = {name for name in {"ratio", *both} - wanted if f"damping_{name}" in asked.fit}
    if unknown:
        form = "ratio" if by_ratio else "translation and rotation"
        remedy = "write material.damping in the form that is wanted in fit"
        found.append((f"the damping starts from {form}", remedy, "fit"))
    if "contact_cutoff" in asked.fit and asked.contact is None:
        remedy = "give contact, with law: angle"
        found.append(("the cut-off of no contact is wanted", remedy, "fit"))
    if asked.contact is not None and asked.contact.law != "angle":
        remedy = "give contact of law: angle, or none"
        found.append(("contact by the law of distance is not known here", remedy, "contact"))
    found += _find_start_faults(asked)
    computed = [each.virtual is not None for each in asked.data]
    if any(computed) != (asked.virtual is not None):
        remedy = "give virtual.truth with virtual sets, and only then"
        found.append(("data are computed with true constants", remedy, "virtual"))
    return found


def _find_start_faults(asked: Calibration) -> list[tuple[str, str, str]]:
    """Checks the values to start from, and the true ones: fault, remedy, key."""
    found = []
    for part in ("ratio", "translation", "rotation"):
        if f"damping_{part}" in asked.fit and getattr(asked.material.damping, part) == 0.0:
            what = "a wanted constant starts at zero, and steps are by factors"
            found.append((what, "give a value above zero", f"material.damping.{part}"))
    contact = asked.contact
    if "contact_cutoff" in asked.fit and contact and contact.cutoff_angle <= contact.barrier_angle:
        remedy = "start from an angle above the barrier_angle"
        found.append(("the cut-off starts below the barrier", remedy, "contact.cutoff_angle"))
    known = {"material": asked.material}
    if asked.virtual is not None:
        known["virtual.truth"] = asked.virtual.truth
    for key, material in known.items():
        critical = material.damping.ratio is not None and material.damping.ratio >= 1.0
        if critical and any(isinstance(each, FreeDecay) for each in asked.data):
            what = "nothing swings at such a damping ratio, and a free decay is of swings"
            found.append((what, "give a ratio below one", f"{key}.damping.ratio"))
    return found
