import math
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from pipeline.problem.fields import quantities, units
from pipeline.problem.fields.units import Dimension, parse_quantity
from pipeline.runtime import UserError

DIMENSIONS = [value for value in vars(units).values() if isinstance(value, Dimension)]


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("15 mm", units.LENGTH, 15.0),
        ("1.5cm", units.LENGTH, 15.0),
        ("-2e-3 m", units.LENGTH, -2.0),
        ("20 deg", units.ANGLE, math.radians(20.0)),
        ("20°", units.ANGLE, math.radians(20.0)),
        ("6.18 kg/m^2", units.AREAL_DENSITY, 6.18e-9),
        ("6.18 kg / m**2", units.AREAL_DENSITY, 6.18e-9),
        ("120 N/mm", units.STIFFNESS, 120.0),
        ("120 kN/m", units.STIFFNESS, 120.0),
        ("1.5 N mm", units.BENDING_STIFFNESS, 1.5),
        ("1.5 N mm/rad", units.BENDING_STIFFNESS, 1.5),
        ("1.5 N*mm/deg", units.BENDING_STIFFNESS, math.degrees(1.5)),
        ("1.5 N·mm/rad^2", units.CONTACT_STIFFNESS, 1.5),
        ("2.876e-2 kg/s", units.DAMPING, 2.876e-5),
        ("1.19e-7 kg m^2/s", units.ROTARY_DAMPING, 1.19e-4),
        ("500 ms", units.TIME, 0.5),
        ("2 min", units.TIME, 120.0),
        ("3 in", units.LENGTH, 76.2),
        ("1.5 kPa m", units.STIFFNESS, 1.5),
        ("2 J", units.BENDING_STIFFNESS, 2000.0),
        ("7 µm", units.LENGTH, 0.007),
        ("3 g/cm^2", units.AREAL_DENSITY, 3e-8),
        ("2 Hz", units.FREQUENCY, 2.0),
    ],
)
def test_words_become_working_units(text: str, dimension: Dimension, value: float) -> None:
    assert parse_quantity(text, dimension) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "dimension", "what"),
    [
        ("4.5 s", units.LENGTH, "the unit 's' is not that of a length"),
        ("20 mm", units.ANGLE, "the unit 'mm' is not that of an angle"),
        ("3 rad", units.LENGTH, "the unit 'rad' is not that of a length"),
        ("2 rad/s", units.FREQUENCY, "the unit 'rad/s' is not that of a frequency"),
        ("15", units.LENGTH, "the unit is missing"),
        (15, units.LENGTH, "the unit is missing"),
        (0.3, units.ANGLE, "the unit is missing"),
        ("15 parsec", units.LENGTH, "unknown unit 'parsec'"),
        ("15 mm^", units.LENGTH, "unknown unit 'mm^'"),
        ("9**9**9 mm", units.LENGTH, "unknown unit '**9**9 mm'"),
        ("1 __import__('os')", units.LENGTH, "unknown unit \"__import__('os')\""),
        ("15 mm" + " " * 76, units.LENGTH, "not a number with a unit"),
        ("1" + "0" * 78 + " mm", units.LENGTH, "not a number with a unit"),
        ("mm", units.LENGTH, "not a number with a unit"),
        (".nan mm", units.LENGTH, "not a number with a unit"),
        ("1e400 mm", units.LENGTH, "not a finite number"),
        ("", units.LENGTH, "not a number with a unit"),
        (None, units.LENGTH, "not a quantity"),
        (True, units.LENGTH, "not a quantity"),
        (["15 mm"], units.LENGTH, "not a quantity"),
    ],
)
def test_refusal_names_the_unit_and_an_example(
    text: object, dimension: Dimension, what: str
) -> None:
    with pytest.raises(UserError) as caught:
        parse_quantity(text, dimension)
    assert caught.value.what == what
    assert dimension.example in str(caught.value.remedy)


@pytest.mark.parametrize("dimension", DIMENSIONS, ids=lambda dimension: dimension.name)
@given(value=st.floats(-1e6, 1e6))
def test_working_units_pass_unchanged(dimension: Dimension, value: float) -> None:
    assert parse_quantity(f"{value!r} {dimension.unit}", dimension) == value


@pytest.mark.parametrize("dimension", DIMENSIONS, ids=lambda dimension: dimension.name)
def test_examples_are_valid(dimension: Dimension) -> None:
    assert parse_quantity(dimension.example, dimension) > 0


@given(text=st.text(alphabet="019.e+- mNskrad/^*()[]_°'\n", max_size=200))
def test_any_text_is_read_or_refused(text: str) -> None:
    with suppress(UserError):
        assert math.isfinite(parse_quantity(text, units.LENGTH))


@pytest.mark.parametrize(
    ("name", "zero", "vanishes"),
    [
        ("Length", "0 mm", False),
        ("Duration", "0 s", False),
        ("Frequency", "0 Hz", False),
        ("Density", "0 kg/m^2", False),
        ("Force", "0 N", False),
        ("Modulus", "0 MPa", False),
        ("Stiffness", "0 N/mm", False),
        ("BendingStiffness", "0 N mm/rad", False),
        ("ContactStiffness", "0 N mm/rad^2", False),
        ("Gap", "0 mm", True),
        ("Delay", "0 s", True),
        ("Damping", "0 kg/s", True),
        ("RotaryDamping", "0 kg m^2/s", True),
    ],
)
def test_quantities_that_may_be_zero(name: str, zero: str, vanishes: bool) -> None:
    reader: TypeAdapter[float] = TypeAdapter(getattr(quantities, name))
    if vanishes:
        assert reader.validate_python(zero) == 0.0
        return
    with pytest.raises(ValidationError, match="must be greater than zero"):
        reader.validate_python(zero)
