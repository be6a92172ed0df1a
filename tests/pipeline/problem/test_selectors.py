import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Quads, Region, selected_units, units_within
from pipeline.problem.sections.selectors import ListedUnits, NamedUnits
from pipeline.problem.sections.shapes import DiscShape, RingShape
from tests.tables import cases


def lattice(columns: int, rows: int, spacing: float = 15.0) -> Quads:
    given = {"columns": columns, "rows": rows, "spacing": spacing, "bias_angle": math.radians(20.0)}
    return Quads.model_validate(given | {"ligament_length": 0.15 * spacing}, context=SIM_UNITS)


def disc(radius: float) -> Region:
    return Region(disc=DiscShape.model_validate({"radius": radius}, context=SIM_UNITS))


@cases("problem", "selector, units")
def test_names_mean_sides(selector: NamedUnits, units: list[int]) -> None:
    assert list(selected_units(selector, lattice(3, 5))) == units


def test_listed_units_are_sorted_and_corners_unique() -> None:
    listed = ListedUnits(units=((2, 1), (0, 0), (2, 1)))
    assert selected_units(listed, lattice(3, 5)) == (0, 5)
    assert selected_units("corners", lattice(4, 1)) == (0, 3)
    assert selected_units("corners", lattice(1, 1)) == (0,)


@pytest.mark.parametrize(("radius", "count"), [(2.5, 21), (4.5, 69), (6.5, 137), (8.5, 225)])
def test_discs_hold_as_many_units_as_in_the_paper(radius: float, count: int) -> None:
    assert len(units_within(disc(radius * 15.0), lattice(31, 31))) == count


@given(inner=st.floats(0.0, 80.0), outer=st.floats(0.1, 80.0), size=st.integers(1, 12))
def test_a_ring_is_the_difference_of_two_discs(inner: float, outer: float, size: int) -> None:
    grid = lattice(size, size)
    shape = RingShape.model_validate({"inner": inner, "outer": outer}, context=SIM_UNITS)
    within_inner = set(units_within(disc(max(inner, 1e-9)), grid))
    expected = set(units_within(disc(outer), grid)) - within_inner
    assert set(units_within(Region(ring=shape), grid)) == expected


@given(scale=st.floats(1e-3, 1e3))
def test_rims_do_not_depend_on_the_scale(scale: float) -> None:
    assert len(units_within(disc(2.0 * scale), lattice(7, 7, scale))) == 13
