from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.posing import time_refinement
from sim.time_integration import ExplicitRecord


def test_relative_errors_are_of_each_case() -> None:
    """Of a large motion that is missed by a tenth, and a small one that is missed by half."""
    target = np.ones((2, 4, 3, 3)) * np.array([100.0, 1.0])[:, None, None, None]
    motion = target * np.array([1.1, 1.5])[:, None, None, None]
    along = np.array([0.0, 0.1, 0.4, 1.0])
    found = time_refinement.relative_errors(motion, target, along)
    np.testing.assert_allclose(found, [0.1, 0.5])


@pytest.mark.parametrize("graded_first", [True, False])
def test_steps_are_graded_if_those_of_one_case_are(graded_first: bool) -> None:
    equal = ExplicitRecord(steps=SimpleNamespace(h=1e-5), checkpoints=None, topology=None)  # type: ignore[arg-type]
    records = (object(), equal) if graded_first else (equal, object())
    run = SimpleNamespace(records=records)
    assert np.isnan(time_refinement._time_step(run))  # type: ignore[arg-type]
    run.records = (equal,)
    assert time_refinement._time_step(run) == 1e-5  # type: ignore[arg-type]
