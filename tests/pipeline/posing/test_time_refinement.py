from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from pipeline import problem
from pipeline.posing import time_refinement
from pipeline.runtime import ROOT
from reports.figures.wave.monitored_places import relative_error
from sim.time_integration import ExplicitRecord


def test_the_relative_error_is_the_mean_of_those_of_the_cases() -> None:
    """Of a large motion that is missed by a tenth, and a small one that is missed by half."""
    target = np.ones((2, 4, 3, 3)) * np.array([100.0, 1.0])[:, None, None, None]
    motion = target * np.array([1.1, 1.5])[:, None, None, None]
    along, weights = np.array([0.0, 0.1, 0.4, 1.0]), np.array([1.0, 3.0])
    found = time_refinement.relative_error(motion, target, along, weights)
    assert found == pytest.approx((0.1 + 3 * 0.5) / 4)


def test_it_is_that_of_the_report() -> None:
    asked = problem.load(ROOT / "experiments/fig7/problem.yaml")
    along, rng = np.linspace(0.0, 0.1, 7), np.random.default_rng(0)
    motions = rng.normal(size=(2, 1, 7, 5, 3))
    dims = ("structure", "case", "time", "unit", "dof")
    coords = {"structure": ["intact", "altered"], "dof": ["ux", "uy", "theta"], "time": along}
    response = xr.Dataset({"displacement": (dims, motions), "roi": ("unit", [1] * 5)}, coords)
    told = relative_error(asked, response).sel(structure="altered").item()
    intact, altered = motions / np.array([asked.lattice.spacing] * 2 + [1.0])
    found = time_refinement.relative_error(altered, intact, along, np.ones(1))
    assert found == pytest.approx(told)


@pytest.mark.parametrize("graded_first", [True, False])
def test_steps_are_graded_if_those_of_one_case_are(graded_first: bool) -> None:
    equal = ExplicitRecord(steps=SimpleNamespace(h=1e-5), checkpoints=None, topology=None)  # type: ignore[arg-type]
    records = (object(), equal) if graded_first else (equal, object())
    run = SimpleNamespace(records=records)
    assert np.isnan(time_refinement._time_step(run))  # type: ignore[arg-type]
    run.records = (equal,)
    assert time_refinement._time_step(run) == 1e-5  # type: ignore[arg-type]
