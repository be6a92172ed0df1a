"""What is said of a benchmark beside the last stored one."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.harness import BenchmarkReport, CandidateResult, comparison
from tests.benchmarks import toy_benchmark

MACHINE = {"processor": "abacus", "commit": "0123456789abcdef", "date": "2026-01-01T00:00"}


def report(seconds: float, error: float) -> BenchmarkReport:
    measured = CandidateResult(
        "coarse", cpu_s=(seconds,), errors={"loss@a": error, "loss@b": error / 2}
    )
    failed = CandidateResult("fine", failure="no such integral")
    return BenchmarkReport(toy_benchmark.benchmark(), (measured, failed), MACHINE)


def test_the_yardstick_is_a_time() -> None:
    assert 1e-4 < comparison.yardstick() < 10


@pytest.mark.parametrize(
    ("seconds", "error", "lines"),
    [
        (2.2, 1.1e-3, []),
        (2.4, 1e-3, ["coarse: slower, 1.20 times the time"]),
        (1.0, 2e-3, ["coarse: loss less accurate, 2.00 times the error"]),
    ],
)
def test_more_than_15_percent_is_told(seconds: float, error: float, lines: list[str]) -> None:
    before = comparison.record(report(1.0, 1e-3), yard=0.5)
    # the second machine is half as fast: its seconds are twice as many
    assert comparison.worse(comparison.record(report(seconds, error), yard=1.0), before) == lines


def test_rounding_is_no_loss_of_accuracy() -> None:
    before = comparison.record(report(1.0, 1e-16), yard=1.0)
    assert comparison.worse(comparison.record(report(1.0, 1e-14), yard=1.0), before) == []


def test_a_record_is_kept_with_machine_and_commit(tmp_path: Path) -> None:
    path = tmp_path / "kept.json"
    made = comparison.record(report(1.0, 1e-3), yard=0.5)
    assert "nothing stored" in comparison.told("toy", made, path)
    comparison.keep("toy", made, path)
    assert comparison.stored(path) == {"toy": made}
    assert made["candidates"] == {"coarse": {"time": 2.0, "errors": {"loss": 1e-3}}}
    assert "abacus, commit 0123456789" in comparison.told("toy", made, path)
