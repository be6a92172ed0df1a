"""Defines field types: strings with units outside, floats in mm, N, s, tonne, rad inside."""

from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, WithJsonSchema
from pydantic_core import PydanticCustomError

from pipeline.problem.fields import units
from pipeline.runtime import UserError

SIM_UNITS = {"sim_units": True}
"""Validation context that takes bare floats as they are: for problems read back from a dataset."""


FOLDER = "folder"
"""Key of the validation context under which the folder of the problem file is."""


_LONGEST = 300  # letters of what a file's reader complains of, which may cite what is no text


def fault(what: str, remedy: str, *keys: str | int) -> PydanticCustomError:
    """Builds a validation error with its remedy, and the keys below the validated section."""
    legible = "".join(letter if letter.isprintable() else "?" for letter in what[:_LONGEST])
    told = {"what": legible, "remedy": remedy, "keys": keys}
    return PydanticCustomError("problem", "{what}", told)


def _reader(dimension: units.Dimension, minimum: float | None, exclusive: bool) -> BeforeValidator:
    example = f'e.g. "{dimension.example}"'

    def read(value: object, info: ValidationInfo) -> float:
        if info.context == SIM_UNITS and isinstance(value, int | float):
            return float(value)
        try:
            number = units.parse_quantity(value, dimension)
        except UserError as error:
            raise fault(error.what, str(error.remedy)) from error
        if minimum is not None and (number < minimum or (exclusive and number == minimum)):
            bound = "greater than zero" if exclusive else "zero or more"
            raise fault(f"{dimension.name} must be {bound}", f"give a value {bound}, {example}")
        return number

    return BeforeValidator(read, json_schema_input_type=str)


def _schema(dimension: units.Dimension) -> WithJsonSchema:
    return WithJsonSchema(
        {
            "type": "string",
            "pattern": r"^\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*[A-Za-z\u00b5\u03bc°]",
            "description": f"{dimension.name} with its unit",
            "examples": [dimension.example],
        },
        mode="validation",
    )


def _check_share(number: float) -> float:
    if number > 1.0:
        raise fault(f"a share of {number:.0%} is too large", "give a share: 5 % is 0.05")
    return number


Length = Annotated[float, _reader(units.LENGTH, 0.0, True), _schema(units.LENGTH)]
Gap = Annotated[float, _reader(units.LENGTH, 0.0, False), _schema(units.LENGTH)]
Coordinate = Annotated[float, _reader(units.LENGTH, None, False), _schema(units.LENGTH)]
Angle = Annotated[float, _reader(units.ANGLE, None, False), _schema(units.ANGLE)]
Duration = Annotated[float, _reader(units.TIME, 0.0, True), _schema(units.TIME)]
Delay = Annotated[float, _reader(units.TIME, 0.0, False), _schema(units.TIME)]
Frequency = Annotated[float, _reader(units.FREQUENCY, 0.0, True), _schema(units.FREQUENCY)]
Density = Annotated[float, _reader(units.AREAL_DENSITY, 0.0, True), _schema(units.AREAL_DENSITY)]
Force = Annotated[float, _reader(units.FORCE, 0.0, True), _schema(units.FORCE)]
Moment = Annotated[float, _reader(units.MOMENT, None, False), _schema(units.MOMENT)]
Stiffness = Annotated[float, _reader(units.STIFFNESS, 0.0, True), _schema(units.STIFFNESS)]
BendingStiffness = Annotated[
    float, _reader(units.BENDING_STIFFNESS, 0.0, True), _schema(units.BENDING_STIFFNESS)
]
Modulus = Annotated[float, _reader(units.MODULUS, 0.0, True), _schema(units.MODULUS)]
ContactStiffness = Annotated[
    float, _reader(units.CONTACT_STIFFNESS, 0.0, True), _schema(units.CONTACT_STIFFNESS)
]
Damping = Annotated[float, _reader(units.DAMPING, 0.0, False), _schema(units.DAMPING)]
RotaryDamping = Annotated[
    float, _reader(units.ROTARY_DAMPING, 0.0, False), _schema(units.ROTARY_DAMPING)
]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Ratio = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
_AT_MOST_ONE = (AfterValidator(_check_share), Field(json_schema_extra={"maximum": 1.0}))
Share = Annotated[Ratio, *_AT_MOST_ONE]
PositiveShare = Annotated[Positive, *_AT_MOST_ONE]
MOST = 1_000_000
"""Of anything counted: beyond it there is a slip of the hand, or a machine without memory."""
Count = Annotated[int, Field(ge=1, le=MOST, strict=True)]
Samples = Annotated[int, Field(ge=2, le=MOST, strict=True)]
