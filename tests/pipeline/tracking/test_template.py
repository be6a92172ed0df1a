import numpy as np
import pytest
import shapely

from pipeline.tracking.fit.template import measure_distance
from sim.core import Floats

LINE = np.linspace(-8.0, 8.0, 65)

random = np.random.default_rng(7)
angle = 2.0 * np.pi * (np.arange(9) + random.uniform(0.1, 0.9, 9)) / 9
STAR = random.uniform(3.0, 7.0, (9, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize(
    "outline",
    [
        pytest.param(STAR, id="star"),
        pytest.param(np.round(STAR), id="vertices on nodes"),
        pytest.param(np.array([[-5.0, -3.0], [6.0, -3.0], [2.0, 5.0]]), id="level edge"),
        pytest.param(np.array([[-5.0, -3.0], [-5.0, 4.0], [3.0, 0.1]]), id="clockwise"),
    ],
)
def test_nodes_are_as_far_from_an_outline_as_shapely_says(outline: Floats) -> None:
    found = np.empty((len(LINE), len(LINE)), np.float32)
    measure_distance(LINE, outline, np.empty((2, len(LINE))), found)
    area = shapely.Polygon(outline)
    nodes = shapely.points(*np.meshgrid(LINE, LINE))
    inside = np.where(shapely.contains(area, nodes), 1.0, -1.0)
    assert area.is_valid
    assert (inside > 0).sum() > 100
    assert np.abs(found - inside * shapely.distance(area.exterior, nodes)).max() < 1e-5
