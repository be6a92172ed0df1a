"""Ladders: rung after rung in one process, with a bound on the time of each."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.harness import (
    CandidateResult,
    MeasuringLimits,
    SettingLadder,
    WorkPrecisionPoint,
    climb,
    dataset,
)
from pipeline import datasets
from pipeline.datasets import provenance
from tests.benchmarks import toy_benchmark

RUNGS = (("10 points", 11.0), ("1000 points", 1001.0))


def climbed(
    prepare: object, rungs: tuple[tuple[str, float], ...] = RUNGS
) -> list[WorkPrecisionPoint]:
    ladder = SettingLadder("trapezoids", prepare, rungs, own=True, tasks=("loss",))  # type: ignore[arg-type]
    reference = toy_benchmark.exact()().values
    return climb(ladder, reference, MeasuringLimits(repeats=3, limit_s=0.5), 4, lambda _: None)


def test_every_rung_is_measured_and_compared() -> None:
    coarse, fine = climbed(toy_benchmark.at_setting)
    assert (coarse.setting, fine.setting) == ("10 points", "1000 points")
    assert len(coarse.outcome.cpu_s) == 3
    assert fine.outcome.error("loss") < coarse.outcome.error("loss") / 1000
    assert fine.outcome.work == {"evaluations": 1001}


def test_what_takes_too_long_is_ended_and_nothing_tighter_is_tried() -> None:
    fast, slow, never = climbed(toy_benchmark.slow_at_setting, (("a", 0.0), ("b", 1.0), ("c", 2.0)))
    assert fast.outcome.cpu_s
    assert slow.outcome.failure == "took longer than 0.5 s"
    assert never.outcome.failure == "not tried: b took longer than 0.5 s"


def test_a_rung_that_fails_does_not_end_the_others() -> None:
    failed, fine = climbed(toy_benchmark.fails_at_first, (("a", 0.0), ("b", 11.0)))
    assert failed.outcome.failure == "ArithmeticError: too loose"
    assert fine.outcome.cpu_s


def test_points_are_a_dataset_with_units(tmp_path: Path) -> None:
    failed = WorkPrecisionPoint(
        "rule", "c", "loss", False, 4, CandidateResult("rule", failure="no such method")
    )
    made = dataset([*climbed(toy_benchmark.at_setting), failed])
    told = dict.fromkeys(("machine", "subject", "reference"), "as told")
    origin = provenance.of_recording("{}", {}, synthetic=False, role="rules")
    datasets.write(made.assign_attrs(told), tmp_path / "points.nc", "benchmark", origin)
    read = datasets.read(tmp_path / "points.nc", "benchmark")
    assert read["cpu_time"].attrs["units"] == "s"
    assert read["outcome"].values.tolist() == ["measured", "measured", "no such method"]
    assert np.isnan(read["error"].sel(quantity="loss").values).tolist() == [False, False, True]
    assert read["own"].values.tolist() == [1, 1, 0]
