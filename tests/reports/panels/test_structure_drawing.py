from itertools import combinations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from pipeline import problem
from pipeline.runtime import ROOT
from reports.panels import draw_clamps
from reports.study import CLAMPED, RigidUnits, from_dataset
from tests.reports.compressed_study import response


def _intact(study: str) -> tuple[RigidUnits, float]:
    path = ROOT / f"experiments/{study}/problem.yaml"
    posed = problem.load(path, "quick")
    spacing = posed.lattice.spacing
    return from_dataset(response(posed, path).sel(structure="intact"), spacing), spacing


def test_pads_of_clamped_squares_are_squares() -> None:
    structure, spacing = _intact("fig5")
    draw_clamps(axes := Figure().add_subplot(), structure, spacing)
    assert len(axes.patches) == (structure.support == CLAMPED).sum()
    assert all(isinstance(patch, Rectangle) for patch in axes.patches)


def test_pads_of_clamped_triangles_are_joined_where_they_would_overlap() -> None:
    structure, spacing = _intact("kagome")
    draw_clamps(axes := Figure().add_subplot(), structure, spacing)
    outlines = [patch for patch in axes.patches if isinstance(patch, Polygon)]
    assert len(outlines) == len(axes.patches) < (structure.support == CLAMPED).sum()
    boxes = [patch.get_path().get_extents() for patch in outlines]
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
    for place in structure.centroid[structure.support == CLAMPED]:
        corners = place + spacing * np.array([[-0.49, -0.49], [0.49, 0.49]])
        assert any(patch.get_path().contains_points(corners).all() for patch in outlines)
