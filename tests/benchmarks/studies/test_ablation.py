"""Nothing that is skipped changes a result by more than its tolerance."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from benchmarks.harness.records import errors
from benchmarks.studies.ablation import SKIPS, Skip
from sim.core import Floats

COMPILED = ("compilation", "fresh factors")
"""Those that compile every loop anew, minutes each: tests/slow/test_ablation.py tries them."""


@pytest.mark.parametrize(
    "skip", [skip for skip in SKIPS if skip.name not in COMPILED], ids=lambda skip: skip.name
)
def test_a_skip_changes_nothing_beyond_its_tolerance(skip: Skip) -> None:
    name = "small_wave" if skip.wave else "small_push"
    done, skipped = (skip.prepare(name, made, "loss")().values for made in (0.0, 1.0))
    refuse_change(skip, done, skipped)


def refuse_change(skip: Skip, done: Mapping[str, Floats], skipped: Mapping[str, Floats]) -> None:
    changes = errors(done, skipped)
    assert changes.keys() == done.keys() == skipped.keys()
    assert max(changes.values()) <= skip.tolerance
