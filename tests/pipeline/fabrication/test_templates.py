"""Every tracking dot is drawn once, however the template is split."""

from dataclasses import replace

import pytest
import shapely
from shapely import Point

from pipeline.fabrication.fixtures import templates
from pipeline.fabrication.parts import BuiltSpecimen, Circle
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Fabrication
from tests.pipeline.fabrication import handmade

SPLIT = Fabrication.model_validate({"laser": {"sheet": ["60 mm", "40 mm"]}}, context=SIM_UNITS)


def with_dots(*centres: tuple[float, float]) -> BuiltSpecimen:
    """The six squares, dots of 2 mm in the first one."""
    one = handmade.specimen()
    first, *others = one.units
    dots = tuple(Circle(centre, 2.0) for centre in centres)
    return replace(one, units=(replace(first, markers=dots), *others))


@pytest.mark.parametrize("centre", [(0.0, 0.0), (7.5, 0.0), (6.0, 1.0), (8.9, 1.0), (7.4, 7.6)])
def test_a_dot_on_a_cut_is_drawn_on_one_tile(centre: tuple[float, float]) -> None:
    specimen = with_dots(centre)
    made = list(templates(specimen, handmade.SPACING, SPLIT))
    assert len(made) > 1
    drawn = [hole.centre for part in made for hole in part.holes]
    assert sorted(drawn) == sorted(dot.centre for unit in specimen.units for dot in unit.markers)
    for part in made:
        for hole in part.holes:
            assert part.outline.contains(Point(hole.centre).buffer(hole.diameter / 2 + 0.4))
        assert part.size[0] <= 50.0
        assert part.size[1] <= 30.0
    whole = shapely.union_all([part.outline for part in made])
    assert whole.area == pytest.approx(sum(part.outline.area for part in made))
    assert whole.area == pytest.approx(shapely.box(*whole.bounds).area)
