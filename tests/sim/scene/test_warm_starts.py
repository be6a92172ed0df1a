"""A killed optimisation with paths to start from resumes to the same bytes."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks.scenes import MATERIAL
from sim.core import Floats
from sim.optimise import Evaluate, Journal, SqpOptions, minimise
from sim.scene import Clamp, Design, Evaluator, Loads, Objective, Paths, Scene, Structure, make_plan
from sim.solvers import LinearRamp, PrescribedMotion
from tests.sim.structures import rotating_squares

OPTIONS = SqpOptions(evaluations=6, retreats=0)


@cache
def scene() -> Scene:
    """5 x 5 squares pushed together over four loads; the middle is to be spared of strain."""
    left = 5 * np.arange(5)
    return Scene(
        Structure(rotating_squares(5), MATERIAL),
        Loads((PrescribedMotion(left + 4, LinearRamp(-7.0, 1.0)),), (Clamp(left),), static=True),
        Objective(region=np.array([12]), kind="strain_energy", steps=4),
        Design(cloak=np.array([6, 7, 8, 11, 13, 16, 17, 18])),
    )


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


def test_paths_do_not_pile_up(tmp_path: Path) -> None:
    run(tmp_path)
    assert len(list((tmp_path / "paths").iterdir())) <= 2


def test_a_start_changes_no_more_than_the_tolerance_allows(tmp_path: Path) -> None:
    losses = np.frombuffer(run(tmp_path)).reshape(OPTIONS.evaluations, -1)
    cold = Evaluator(scene(), make_plan(scene()))
    for loss, *design in losses:
        assert cold(np.array(design))[0] == pytest.approx(loss, rel=1e-9)
