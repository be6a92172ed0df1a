"""What is skipped by compiling loops once, and by loops that keep old factors."""

from functools import partial

import pytest

from benchmarks.harness import result_of
from benchmarks.suites import SKIPS, Skip
from tests.benchmarks.test_suites import COMPILED, refuse_change


@pytest.mark.parametrize(
    "skip", [skip for skip in SKIPS if skip.name in COMPILED], ids=lambda skip: skip.name
)
def test_a_skip_changes_nothing_beyond_its_tolerance(skip: Skip) -> None:
    """Each in a process of its own, which has not loaded the loops before."""
    prepare = partial(skip.prepare, "small_wave")
    values = [result_of(prepare, made, "loss") for made in (0.0, 1.0)]
    refuse_change(skip, *values)
