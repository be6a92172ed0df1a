from pathlib import Path

import numpy as np
import pytest

from pipeline.posing import scene_of
from pipeline.problem import cloak_units, interest_units, void_units
from pipeline.problem.reading import load
from sim.scene import Evaluator, make_plan
from tests.pipeline.static import HEART, MIMIC, RIGID_HEART, SHIELD, SMILE, write
from tests.tables import cases, refused


@pytest.mark.parametrize(
    ("more", "size", "counts"),
    [
        (SMILE, 15, (18, 56, 151, 292, 369)),
        (HEART, 30, (142, 193, 565, 922, 1423)),
        (RIGID_HEART, 15, (0, 60, 143, 306, 420)),
        (SHIELD, 15, (0, 44, 69, 264, 420)),
    ],
    ids=["smile", "heart", "rigid heart", "shield"],
)
def test_counts_are_authors(tmp_path: Path, more: str, size: int, counts: tuple[int, ...]) -> None:
    """Units of the void, the cloak and of interest; variables of the design; ligaments."""
    problem = load(write(tmp_path, more, size))
    scene = scene_of(problem, tmp_path)
    found = [len(units(problem)) for units in (void_units, cloak_units, interest_units)]
    assert (*found, scene.space.n_variables, scene.lattice.n_ligaments) == counts


def test_losses_at_the_start_are_the_papers(tmp_path: Path) -> None:
    for more, steps, loss in ((SMILE, 20, 0.920), (SHIELD, 10, 13.13)):
        path = write(tmp_path, more)
        path.write_text(path.read_text().replace("steps: 4", f"steps: {steps}"))
        scene = scene_of(load(path), tmp_path)
        found, _, _ = Evaluator(scene, make_plan(scene))(np.zeros(scene.space.n_variables))
        assert found == pytest.approx(loss, abs=5e-3 * loss)


@cases("problem", "more, what, key")
def test_a_bad_void_is_told(tmp_path: Path, more: str, what: str, key: str) -> None:
    cloak = "cloak: { disc: { centre: [75 mm, 60 mm], radius: 30 mm } }\n" + MIMIC
    with refused(what, key):
        load(write(tmp_path, more + cloak, size=9))
