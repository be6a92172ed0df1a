"""Describes what holds units, and what drives them: one model per kind, told apart by `kind`.

Driven units have all three degrees of freedom prescribed: the displacement follows the drive along
one direction per load case, the rotation is held (a time series prescribes all three). `free` sets
some of them free. Where the drive is a force, they give way along it.
"""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, GetJsonSchemaHandler, StringConstraints, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from pipeline.problem.fields import (
    Angle,
    Delay,
    Duration,
    File,
    Force,
    Frequency,
    Length,
    Moment,
    Ratio,
    Section,
    fault,
)
from pipeline.problem.sections.selectors import Selector

_SUM_TOLERANCE = 1e-6
Dof = Literal["ux", "uy", "theta"]
_DOFS: tuple[Dof, ...] = ("ux", "uy", "theta")


def _moves(amplitude: float) -> float:
    if amplitude == 0.0:
        raise fault("a drive of zero moves nothing", "give an amplitude above or below zero")
    return amplitude


class Support(Section):
    """Units with some of their degrees of freedom held at zero.

    Attributes:
        units: by side, or listed.
        clamp: the degrees of freedom; what is built holds all three, and says so.
    """

    units: Selector
    clamp: Annotated[tuple[Dof, ...], Field(min_length=1)] = _DOFS


class _Drive(Section):
    """A drive of units.

    Attributes:
        kind: which of the drives this is.
        units: that are driven.
        free: degrees of freedom of these units that nothing holds, such as the way sideways; what
            is built holds them.
    """

    unit: ClassVar[str] = "mm"
    """Of the amplitude, in which it is read."""
    units: Selector
    free: tuple[Dof, ...] = ()

    @property
    def case_weights(self) -> tuple[float, ...]:
        """Returns the weight of the one load case."""
        return (1.0,)

    @property
    def acting(self) -> tuple[Dof, ...]:
        """Lists the degrees of freedom that the drive moves in some load case."""
        return ("theta",)

    @property
    def prescribed(self) -> tuple[Dof, ...]:
        """Lists the degrees of freedom whose motion the drive gives, be it none."""
        return tuple(dof for dof in _DOFS if dof not in self.free)

    @model_validator(mode="before")
    @classmethod
    def _kind_is_no_key(cls, data: object) -> object:
        for kind in ("force", "torque", "rotation"):
            if isinstance(data, Mapping) and kind in data:
                remedy = f"a {kind} is a drive of its own: `kind: {kind}` with `amplitude`"
                raise fault("unknown key", remedy, kind)
        return data

    @model_validator(mode="after")
    def _is_not_free(self) -> Self:
        if both := [dof for dof in self.acting if dof in self.free]:
            what = f"the drive acts on {both[0]}, which is to be free"
            raise fault(what, "drive it or set it free, not both", "free")
        return self


class _Directed(_Drive):
    """A drive along straight lines, one load case per direction.

    Attributes:
        directions: of the displacement or force against x, counter-clockwise; or `direction`, one.
        weights: of the load cases in the loss, adding up to 1; equal ones by default.
    """

    directions: Annotated[tuple[Angle, ...], Field(min_length=1)]
    weights: tuple[Ratio, ...] | None = None

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Adds `direction`, which stands for a list of one."""
        made = super().__get_pydantic_json_schema__(core_schema, handler)
        whole = handler.resolve_ref_schema(made)
        several = whole["properties"]["directions"]
        whole["properties"]["direction"] = several["items"] | {"description": "instead of a list"}
        whole["required"] = [name for name in whole["required"] if name != "directions"]
        whole["oneOf"] = [{"required": ["directions"]}, {"required": ["direction"]}]
        return made

    @property
    def case_weights(self) -> tuple[float, ...]:
        """Computes the weight of each load case in the loss; equal ones where none are given."""
        return self.weights or (1.0 / len(self.directions),) * len(self.directions)

    @property
    def acting(self) -> tuple[Dof, ...]:
        """Lists the degrees of freedom that the drive moves in some load case."""
        parts: tuple[tuple[Dof, float], ...] = (
            ("ux", max(abs(math.cos(angle)) for angle in self.directions)),
            ("uy", max(abs(math.sin(angle)) for angle in self.directions)),
        )
        return tuple(dof for dof, part in parts if part > _SUM_TOLERANCE)

    @model_validator(mode="before")
    @classmethod
    def _one_direction(cls, data: object) -> object:
        if not isinstance(data, Mapping) or "direction" not in data:
            return data
        if "directions" in data:
            what = "direction and directions exclude each other"
            raise fault(what, "give one of them", "direction")
        others = {key: value for key, value in data.items() if key != "direction"}
        return {**others, "directions": [data["direction"]]}

    @model_validator(mode="after")
    def _weights_match(self) -> Self:
        if self.weights is None:
            return self
        if len(self.weights) != len(self.directions):
            what = f"{len(self.weights)} weights for {len(self.directions)} directions"
            raise fault(what, "give one weight per direction, or none for equal ones", "weights")
        if not math.isclose(total := math.fsum(self.weights), 1.0, abs_tol=_SUM_TOLERANCE):
            what = f"the weights add up to {total:g}"
            raise fault(what, "scale them to add up to 1, or give none for equal ones", "weights")
        return self


class DisplacementDrive(_Directed):
    """A displacement along straight lines.

    Attributes:
        amplitude: A, of the displacement.
    """

    amplitude: Length


class HarmonicDrive(DisplacementDrive):
    """A sin(2 pi f t) from the first instant, as the authors drive the shielding sample.

    Attributes:
        frequency: f.
    """

    kind: Literal["harmonic"]
    frequency: Frequency


class RampHarmonicDrive(DisplacementDrive):
    """A (1 + tanh((t - delay)/rise_time))/2 sin(2 pi f (t - delay)).

    Attributes:
        frequency: f.
        rise_time: half the time in which it grows from 12 % to 88 %.
        delay: until it has grown to one half.
    """

    kind: Literal["ramp_harmonic"]
    frequency: Frequency
    rise_time: Duration
    delay: Delay = 0.0


class PulseDrive(DisplacementDrive):
    """A exp(-((t - delay)/width)^2), a single push there and back.

    Attributes:
        width: half the time in which it is above 37 % of its peak.
        delay: until its peak; three widths or more, for it to begin at rest.
    """

    kind: Literal["pulse"]
    width: Duration
    delay: Duration


class TanhRampDrive(DisplacementDrive):
    """A (1 + tanh(6 (2 t/duration - 1)))/2, the authors' slow compression.

    Attributes:
        duration: of the ramp, and of the horizon: a static path has no time, it names the loads.
    """

    kind: Literal["tanh_ramp"]
    duration: Duration


class LinearRampDrive(DisplacementDrive):
    """A t/duration.

    Attributes:
        duration: of the ramp, and of the horizon: a static path has no time, it names the loads.
    """

    kind: Literal["linear_ramp"]
    duration: Duration


class _Course(Section):
    """A load that grows in proportion to the load path, unless it has a course in time.

    Attributes:
        frequency: f of a course sin(2 pi f t).
        rise_time: of the switch by which that begins, as of a `ramp_harmonic`.
        width: of a single push there and back, as of a `pulse`.
        delay: of a push until its peak, three widths or more for it to begin at rest; of a wave
            with a `rise_time` until it has grown to one half.
    """

    frequency: Frequency | None = None
    rise_time: Duration | None = None
    width: Duration | None = None
    delay: Delay = 0.0

    @property
    def static(self) -> bool:
        """Tells a load that grows slowly."""
        return self.frequency is None and self.width is None

    @model_validator(mode="after")
    def _check_course(self) -> Self:
        if self.frequency is not None and self.width is not None:
            raise fault("frequency and width exclude each other", "give one of them", "width")
        if self.rise_time is not None and self.frequency is None:
            raise fault("nothing rises without a frequency", "give `frequency` too", "rise_time")
        if self.delay and self.static:
            raise fault("a load path has no delay", "give `frequency` or `width` too", "delay")
        if self.width is not None and not self.delay:
            remedy = f"let it come later, after three widths ({3.0 * self.width:g} s) or more"
            raise fault("a push without a delay begins at its peak", remedy, "delay")
        if self.delay and self.frequency is not None and self.rise_time is None:
            what = "a wave without a rise time is not delayed: its phase is shifted alone"
            raise fault(what, "give `rise_time` too, or no delay", "delay")
        return self


class ForceDrive(_Course, _Directed):
    """A force on the driven units together, shared equally, in place of a displacement.

    It keeps its direction. The units' rotation, and the way across a force along x or y, stay held
    unless they are `free`.

    Attributes:
        amplitude: A, of the force on all units together.
    """

    unit: ClassVar[str] = "N"
    kind: Literal["force"]
    amplitude: Force


class TorqueDrive(_Course, _Drive):
    """A moment on the driven units together, shared equally, in place of a rotation.

    The units stay in place unless `ux` and `uy` are `free`.

    Attributes:
        amplitude: of the moment on all units together, counter-clockwise.
    """

    unit: ClassVar[str] = "N mm"
    kind: Literal["torque"]
    amplitude: Annotated[Moment, AfterValidator(_moves)]


class RotationDrive(_Course, _Drive):
    """A rotation of each driven unit, about its centroid.

    The units stay in place unless `ux` and `uy` are `free`.

    Attributes:
        amplitude: of the rotation, counter-clockwise.
    """

    unit: ClassVar[str] = "rad"
    kind: Literal["rotation"]
    amplitude: Annotated[Angle, AfterValidator(_moves)]


class TimeSeriesDrive(_Drive):
    """A measured motion (x, y, theta) of the driven units, read from a file beside the problem.

    The file is a CSV whose heading names the columns `time (s)`, `ux (mm)`, `uy (mm)` and
    `theta (rad)`, or other units of these kinds in the brackets; lines above it are comments. Times
    ascend from zero to the end of the horizon at least, where `horizon: { duration: 1 s }` gives
    it; the motion starts at rest, and between two lines it is interpolated linearly. Columns of
    `free` degrees of freedom are read and left aside.

    Attributes:
        file: with the motion.
        sha256: of the file, which is refused if it has another.
    """

    kind: Literal["time_series"]
    file: File
    sha256: Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")] | None = None

    @property
    def acting(self) -> tuple[Dof, ...]:
        """Lists the degrees of freedom that the drive moves."""
        return self.prescribed


SingleDrive = (
    HarmonicDrive
    | RampHarmonicDrive
    | PulseDrive
    | TanhRampDrive
    | LinearRampDrive
    | ForceDrive
    | TorqueDrive
    | RotationDrive
    | TimeSeriesDrive
)
