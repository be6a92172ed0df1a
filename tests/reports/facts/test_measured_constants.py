"""Losses over measured constants are told by mean and 95 %, failed draws apart."""

import numpy as np
import xarray as xr

from pipeline import problem
from pipeline.problem import Problem
from reports.facts import constants_facts
from tests.pipeline.conftest import FIG2


def asked() -> Problem:
    return problem.load(FIG2)


def losses(cloaked: list[float], altered: list[float]) -> xr.Dataset:
    status = np.where(np.isfinite(cloaked), "ok", "no equilibrium")
    named = {"loss": cloaked, "loss_altered": altered, "status": status}
    return xr.Dataset({name: ("case", values) for name, values in named.items()})


def test_mean_and_interval_leave_failed_draws_out() -> None:
    made = losses([0.1, 0.2, np.nan], [1.0, 1.0, np.nan])
    start, end, gain = constants_facts(asked(), made, (1.0, 0.1))
    np.testing.assert_allclose([start.value, end.value, gain.value], [1.0, 0.15, 85.0])
    assert end.ours == "0.15 (0.103 to 0.198)"
    assert end.note == "nominal 0.1; mean and 95 % of 3 draws, 1 of them failed"
    assert gain.note.startswith("nominal 90.0 %")


def test_no_constants_no_facts_and_no_result_says_why() -> None:
    assert list(constants_facts(asked(), None, (1.0, 0.1))) == []
    (only,) = constants_facts(asked(), losses([np.nan], [np.nan]), (1.0, 0.1))
    assert (only.ours, only.note) == ("none", "no equilibrium")
