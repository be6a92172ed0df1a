from functools import cache
from pathlib import Path

import numpy as np
import pytest

from sim.core import Floats
from sim.optimise import Evaluate, Journal, SqpOptions, minimise
from sim.scene import Evaluator, Paths, Scene, make_plan
from tests.sim.structures import pressed

OPTIONS = SqpOptions(evaluations=6, retreats=0)


@cache
def scene() -> Scene:
    return pressed(7.0, kind="strain_energy", steps=4)


def run(folder: Path, dies_at: int | None = None) -> bytes:
    """Optimises, resuming from the folder; returns the bytes of all that was computed."""
    paths = Paths(folder / "paths")
    evaluate = Evaluator(scene(), make_plan(scene()), paths)
    with Journal(folder / "journal", "a") as journal:
        found = minimise(
            "sqp",
            journal.wrap(mortal(evaluate, dies_at)),
            None,
            np.zeros(scene().space.n_variables),
            options=OPTIONS,
            callback=paths.accept,
        )
    assert sum(e.accepted for e in found.evaluations) > 2
    return b"".join(np.array([e.loss, *e.x]).tobytes() for e in found.evaluations)


def mortal(evaluate: Evaluate, dies_at: int | None) -> Evaluate:
    calls = 0

    def dying(design: Floats) -> tuple[float, Floats, Floats]:
        nonlocal calls
        result = evaluate(design)
        calls += 1
        if calls == dies_at:  # after the path was stored, before the journal has the result
            raise KeyboardInterrupt
        return result

    return dying


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, bytes]:
    folder = tmp_path_factory.mktemp("whole")
    return run(folder), (folder / "journal").read_bytes()


@pytest.mark.parametrize("dies_at", [1, 3, 5])
def test_a_killed_run_resumes_to_the_same_bytes(
    tmp_path: Path, uninterrupted: tuple[bytes, bytes], dies_at: int
) -> None:
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, dies_at)
    assert run(tmp_path) == uninterrupted[0]
    assert (tmp_path / "journal").read_bytes() == uninterrupted[1]


def test_paths_change_no_more_than_the_tolerance_allows_and_do_not_pile_up(tmp_path: Path) -> None:
    losses = np.frombuffer(run(tmp_path)).reshape(OPTIONS.evaluations, -1)
    cold = Evaluator(scene(), make_plan(scene()))
    for loss, *design in losses:
        assert cold(np.array(design))[0] == pytest.approx(loss, rel=1e-9)
    run(tmp_path)
    assert len(list((tmp_path / "paths").iterdir())) <= 2
