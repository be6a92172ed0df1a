"""A sweep's benchmark counts its cases, and each is what it is alone."""

from __future__ import annotations

import numpy as np

from benchmarks.studies import sweep_growth


def test_a_case_does_not_depend_on_those_after_it() -> None:
    alone, three = (sweep_growth.cases("quick", count)() for count in (1, 3))
    assert (alone.work, three.work) == ({"cases": 1}, {"cases": 3})
    assert np.isfinite(alone.values["loss"]).all()
    np.testing.assert_array_equal(alone.values["loss"], three.values["loss"])
