from dataclasses import replace
from itertools import combinations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Rectangle

from pipeline import problem
from pipeline.runtime import ROOT
from reports.panels import draw_clamps
from reports.panels.structure_drawing import pads
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
    outlines = [patch for patch in axes.patches if isinstance(patch, PathPatch)]
    assert len(outlines) == len(axes.patches) < (structure.support == CLAMPED).sum()
    boxes = [patch.get_path().get_extents() for patch in outlines]
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
    for place in structure.centroid[structure.support == CLAMPED]:
        corners = place + spacing * np.array([[-0.49, -0.49], [0.49, 0.49]])
        assert any(patch.get_path().contains_points(corners).all() for patch in outlines)


def test_the_inside_of_a_clamped_rim_is_no_pad() -> None:
    structure, spacing = _intact("fig5")
    ends = structure.centroid.min(axis=0), structure.centroid.max(axis=0)
    rim = np.any([np.isclose(structure.centroid, end, atol=spacing / 2) for end in ends], (0, 2))
    support = np.where(rim, CLAMPED, 0)
    ((outer, inner),) = pads(replace(structure, support=support), 1.2 * spacing)
    sides = [np.ptp(ring, axis=0) for ring in (outer, inner)]
    np.testing.assert_allclose(sides[0], ends[1] - ends[0] + 1.2 * spacing)
    np.testing.assert_allclose(sides[1], ends[1] - ends[0] - 1.2 * spacing)
