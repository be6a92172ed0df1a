"""Every tracking dot is drawn once, however the template is split."""

from dataclasses import replace
from pathlib import Path

import pytest
import shapely
from shapely import Point

from pipeline.fabrication.checks.laser_folder import check_template
from pipeline.fabrication.fixtures import templates
from pipeline.fabrication.parts import BuiltSpecimen, Circle
from pipeline.fabrication.readback import Drawing
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


@pytest.mark.parametrize("scored", [True, False], ids=["scored", "not scored"])
def test_dots_of_a_unit_that_a_template_is_split_through_are_none_too_many(scored: bool) -> None:
    """Its outline is open on both templates; where none is scored the dots are a fault."""
    (unit, *others) = with_dots((6.0, -2.0), (6.0, 2.0)).units
    long = shapely.box(-5.0, -5.0, 11.0, 5.0)
    specimen = replace(handmade.specimen(), units=(replace(unit, outline=long), *others))
    made = list(templates(specimen, handmade.SPACING, SPLIT))
    crossed = next(part for part in made if part.holes)
    assert crossed.outline.crosses(long.exterior)
    holes = [Point(hole.centre).buffer(hole.diameter / 2) for hole in crossed.holes]
    lines = [shapely.LineString(line) for line in crossed.scores] if scored else []
    faults = list(check_template(Drawing(Path("template.dxf"), (), {}), "TEMPLATE1", holes, lines))
    assert [fault.what for fault in faults] == (
        [] if scored else ["2 dots in no unit that is scored"]
    )


def test_a_unit_that_is_scored_may_be_too_small_for_a_dot() -> None:
    template = Drawing(Path("template.dxf"), (), {})
    assert not list(check_template(template, "TEMPLATE1", [], [shapely.box(0, 0, 3, 3).exterior]))
