from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from pipeline.problem.fields import SIM_UNITS, Section
from pipeline.problem.model import Problem
from pipeline.problem.sections.lattices import ListedNetwork
from pipeline.problem.sections.objective import LoadRanges
from pipeline.problem.sections.shapes import Image, Smile
from pipeline.problem.sections.sweep import Sweep
from pipeline.problem.sections.sweep_cases import group_size
from tests.tables import cases


def made(section: type[Section], **values: object) -> Any:  # noqa: ANN401
    return section.model_validate(values, context=SIM_UNITS)


def sections(of: type[Section] = Section) -> Iterator[type[Section]]:
    for below in of.__subclasses__():
        yield below
        yield from sections(below)


def test_a_default_is_a_value_that_may_be_given() -> None:
    found = list(sections())
    assert Problem in found
    for section in found:
        for name, field in section.model_fields.items():
            if not field.is_required() and field.default_factory is None and field.metadata:
                kind: TypeAdapter[object] = TypeAdapter(field.rebuild_annotation())
                given = kind.validate_python(field.default, context=SIM_UNITS)
                assert given == field.default, f"{section.__name__}.{name}"


@pytest.mark.parametrize("section", [ListedNetwork, Image])
def test_keys_that_are_offered_are_those_of_a_file(section: type[Section]) -> None:
    with pytest.raises(ValidationError) as caught:
        made(section, files="x")
    remedy = caught.value.errors()[0]["ctx"]["remedy"]
    keys = section.model_json_schema()["properties"]
    assert remedy == f"did you mean 'file'? known here: {', '.join(keys)}"


@cases("problem", "section, values, told")
def test_contradictory_keys(section: str, values: dict[str, object], told: str) -> None:
    (of,) = (each for each in sections() if each.__name__ == section)
    with pytest.raises(ValidationError, match=told):
        made(of, **values)


def test_a_range_may_be_open_or_a_point() -> None:
    assert made(LoadRanges, amplitude=[1.0, 1.0]).amplitude == (1.0, 1.0)


def test_directions_that_a_grid_names_first_are_grouped() -> None:
    directions, others = {"drive.directions": [0.0, 1.0, 2.0]}, {"drive.amplitude": [1.0, 2.0]}
    assert group_size(made(Sweep, grid=directions | others)) == 3
    assert group_size(made(Sweep, grid=others | directions)) == 1
    assert group_size(made(Sweep, list=others)) == 1


def test_a_smile_lies_between_its_circles() -> None:
    """The lowest points are a radius below the centres; the outer ends are its half circle's."""
    drawn = made(
        Smile, kind="smile", inner_radius=20.0, inner_rise=12.0, outer_radius=30.0, outer_rise=8.0
    )
    (outline,) = drawn.outlines((100.0, 50.0))
    inner, outer = np.array(outline[:19]), np.array(outline[19:])
    np.testing.assert_allclose(np.hypot(*(inner - [100.0, 62.0]).T), 20.0)
    np.testing.assert_allclose(np.hypot(*(outer - [100.0, 58.0]).T), 30.0)
    assert inner[:, 1].min() == pytest.approx(42.0)
    assert outer[:, 1].min() == pytest.approx(28.0)
