import math
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from pipeline.problem.fields import quantities, units
from pipeline.problem.fields.units import Dimension, parse_quantity
from pipeline.runtime import UserError
from tests.tables import cases, refused

DIMENSIONS = [value for value in vars(units).values() if isinstance(value, Dimension)]


@cases("problem", "text, dimension, value")
def test_words_become_working_units(text: str, dimension: str, value: float) -> None:
    assert parse_quantity(text, getattr(units, dimension)) == pytest.approx(value, rel=1e-14)


@cases("problem", "text, dimension, what")
def test_refusal_names_the_unit_and_an_example(text: object, dimension: str, what: str) -> None:
    wanted = getattr(units, dimension)
    with refused(what, remedy=wanted.example):
        parse_quantity(text, wanted)


@pytest.mark.parametrize("dimension", DIMENSIONS, ids=lambda dimension: dimension.name)
@given(value=st.floats(-1e6, 1e6))
def test_working_units_pass_unchanged(dimension: Dimension, value: float) -> None:
    assert parse_quantity(f"{value!r} {dimension.unit}", dimension) == value


@pytest.mark.parametrize("dimension", DIMENSIONS, ids=lambda dimension: dimension.name)
def test_examples_are_valid(dimension: Dimension) -> None:
    assert parse_quantity(dimension.example, dimension) > 0


@cases("problem", "text, dimension")
def test_an_unknown_unit_is_told_the_known_ones(text: str, dimension: str) -> None:
    with refused("unknown unit", remedy=units.KNOWN):
        parse_quantity(text, getattr(units, dimension))


@pytest.mark.parametrize(
    ("text", "dimension", "meant"),
    [
        ("1 Mm", units.LENGTH, "mm"),
        ("1 Gm", units.LENGTH, "mm"),
        ("1 Ms", units.TIME, "ms"),
        ("1 MN", units.FORCE, "mN"),
        ("1 MN mm", units.MOMENT, "mN"),
        ("1 mm MN", units.MOMENT, "mN"),
        ("1 N Mm/rad", units.BENDING_STIFFNESS, "mm"),
        ("1 N/Mm", units.STIFFNESS, "mm"),
        ("1 Mrad", units.ANGLE, "mrad"),
        ("1 mPa", units.MODULUS, "MPa"),
    ],
)
def test_a_unit_that_nobody_uses_is_refused(text: str, dimension: Dimension, meant: str) -> None:
    with refused("nobody measures", remedy=f"write {meant} if meant"):
        parse_quantity(text, dimension)


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("1 MN/m", units.STIFFNESS, 1e3),
        ("1 MN m^-1", units.STIFFNESS, 1e3),
        ("1 MN/m²", units.MODULUS, 1.0),
        ("1 Mg/m^2", units.AREAL_DENSITY, 1e-6),
        ("1 MHz", units.FREQUENCY, 1e6),
    ],
)
def test_millions_are_read_where_they_are_usual(
    text: str, dimension: Dimension, value: float
) -> None:
    assert parse_quantity(text, dimension) == pytest.approx(value)


@given(text=st.text(alphabet="019.e+- mNskrad/^*()[]_°'\n", max_size=200))
def test_any_text_is_read_or_refused(text: str) -> None:
    with suppress(UserError):
        assert math.isfinite(parse_quantity(text, units.LENGTH))


@cases("problem", "name, zero, vanishes")
def test_quantities_that_may_be_zero(name: str, zero: str, vanishes: bool) -> None:
    reader: TypeAdapter[float] = TypeAdapter(getattr(quantities, name))
    if vanishes:
        assert reader.validate_python(zero) == 0.0
        return
    with pytest.raises(ValidationError, match="must be greater than zero"):
        reader.validate_python(zero)
