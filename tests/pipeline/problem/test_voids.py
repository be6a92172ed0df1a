"""Voids, inclusions and targets, from the problem file to the response."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.posing import scene_of
from pipeline.problem import cloak_units, interest_units, void_units
from pipeline.problem.reading import load
from pipeline.runtime import UserError
from sim.scene import Evaluator, make_plan
from tests.pipeline.static import HEART, MIMIC, RIGID_HEART, SHIELD, SMILE, write


@pytest.mark.parametrize(
    ("more", "size", "removed", "cloak", "interest", "variables", "ligaments"),
    [
        (SMILE, 15, 18, 56, 151, 292, 369),
        (HEART, 30, 142, 193, 565, 922, 1423),
        (RIGID_HEART, 15, 0, 60, 143, 306, 420),
        (SHIELD, 15, 0, 44, 69, 264, 420),
    ],
    ids=["smile", "heart", "rigid heart", "shield"],
)
def test_counts_are_the_authors(
    tmp_path: Path,
    more: str,
    size: int,
    removed: int,
    cloak: int,
    interest: int,
    variables: int,
    ligaments: int,
) -> None:
    problem = load(write(tmp_path, more, size))
    assert len(void_units(problem)) == removed
    assert len(cloak_units(problem)) == cloak
    assert len(interest_units(problem)) == interest
    scene = scene_of(problem, tmp_path)
    assert scene.space.n_variables == variables
    assert scene.lattice.n_ligaments == ligaments


def test_losses_at_the_start_are_the_papers(tmp_path: Path) -> None:
    for more, steps, loss in ((SMILE, 20, 0.920), (SHIELD, 10, 13.13)):
        path = write(tmp_path, more)
        path.write_text(path.read_text().replace("steps: 4", f"steps: {steps}"))
        scene = scene_of(load(path), tmp_path)
        found, _, _ = Evaluator(scene, make_plan(scene))(np.zeros(scene.space.n_variables))
        assert found == pytest.approx(loss, abs=5e-3 * loss)


@pytest.mark.parametrize(
    ("more", "what", "key"),
    [
        (
            "void: { disc: { centre: [15 mm, 60 mm], radius: 20 mm } }\n",
            "the void touches the clamped units: it removes unit [0, 4]",
            "void",
        ),
        (
            "void: { disc: { centre: [105 mm, 60 mm], radius: 20 mm } }\n",
            "the void touches the driven units: it removes unit [8, 4]",
            "void",
        ),
        (
            "void: { polygon: { vertices: [[50 mm, -5 mm], [70 mm, -5 mm], [70 mm, 125 mm],"
            " [50 mm, 125 mm]] } }\n",
            "the void splits the lattice: unit [5, 0] is cut off from the rest",
            "void",
        ),
        (
            "void: { disc: { centre: [66 mm, 66 mm], radius: 5 mm } }\n",
            "no unit lies in the void",
            "void",
        ),
        ("", "nothing is altered, so there is nothing to mimic", "objective.target"),
        (
            "void: { disc: { radius: 20 mm }, ring: { inner: 1 mm, outer: 2 mm } }\n",
            "disc and ring exclude each other",
            "void",
        ),
        ("void: { curve: { kind: hart } }\n", "unknown kind", "void.curve"),
    ],
    ids=["clamped", "driven", "split", "empty", "nothing", "two shapes", "kind"],
)
def test_a_bad_void_is_told(tmp_path: Path, more: str, what: str, key: str) -> None:
    cloak = "cloak: { disc: { centre: [75 mm, 60 mm], radius: 30 mm } }\n" + MIMIC
    with pytest.raises(UserError) as caught:
        load(write(tmp_path, more + cloak, size=9))
    assert what in caught.value.what
    assert caught.value.key == key
    assert caught.value.remedy
