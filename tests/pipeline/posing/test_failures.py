"""A design that cannot be made is told with its place."""

from pathlib import Path

import numpy as np

from pipeline.posing import failures, limits_of, scene_of
from pipeline.problem.reading import load
from sim.constraints import ConstraintVector
from sim.optimise import InfeasibleStartError
from tests.pipeline.static import HOLE, write


def test_an_infeasible_start_names_unit_and_vertex(tmp_path: Path) -> None:
    path = write(tmp_path, HOLE, size=5)
    scene = scene_of(problem := load(path), tmp_path)
    constraints = ConstraintVector(scene.space, limits_of(problem))
    values = constraints.values(np.zeros(scene.space.n_variables))
    for number in (0, len(values) - 1):
        error = InfeasibleStartError(number, 0.5)
        told = failures.infeasible_start(error, constraints, path)
        kind, where = constraints.named(number)
        assert told.key == f"constraints.{'convex' if kind == 'convexity' else kind}"
        assert where in told.what
        assert where.startswith("vertex ")
        assert " of unit [" in where


def test_edges_are_named_by_their_ends(tmp_path: Path) -> None:
    scene = scene_of(problem := load(write(tmp_path, HOLE, size=5)), tmp_path)
    constraints = ConstraintVector(scene.space, limits_of(problem))
    longer = np.zeros(scene.space.n_variables)
    longer[:2] = 4.0
    changed = np.flatnonzero(constraints.values(longer) != constraints.values(0 * longer))
    vertex = np.flatnonzero(scene.lattice.group == scene.space.groups[0])[0]
    i, j = scene.lattice.index[scene.lattice.unit[vertex]]
    assert f"of unit [{i}, {j}]" in constraints.named(int(changed[0]))[1]
