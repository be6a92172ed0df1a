"""The benchmarks' frame on a toy scene; nothing is asserted about times but that there are some."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import registry
from benchmarks.harness import (
    Benchmark,
    BenchmarkReport,
    Candidate,
    CandidateError,
    CandidateResult,
    Target,
    measure,
    storage,
    text_table,
)
from benchmarks.harness.records import errors
from tests.benchmarks import toy_benchmark

MACHINE = {
    "processor": "abacus",
    "core": 0,
    "commit": "0123456789abcdef",
    "date": "2026-01-01",
    "changed_since_commit": [],
}


def measured(
    benchmark: Benchmark, repeats: int = 3
) -> tuple[dict[str, CandidateResult], list[str]]:
    told: list[str] = []
    outcomes = measure(benchmark, benchmark.candidates, repeats, told.append)
    return {outcome.name: outcome for outcome in outcomes}, told


@pytest.fixture(scope="module")
def outcomes() -> dict[str, CandidateResult]:
    return measured(toy_benchmark.benchmark())[0]


def report(outcomes: dict[str, CandidateResult]) -> BenchmarkReport:
    return BenchmarkReport(toy_benchmark.benchmark(), tuple(outcomes.values()), MACHINE)


def test_candidates_run_in_turn() -> None:
    told = measured(toy_benchmark.benchmark())[1]
    rounds = [line.rpartition(":")[0] for line in told if "round" in line]
    assert rounds == [
        "toy: round 1 of 3: coarse",
        "toy: round 1 of 3: fine",
        "toy: round 2 of 3: coarse",
        "toy: round 3 of 3: coarse",
    ]


def test_outcomes_hold_times_errors_work_and_memory(outcomes: dict[str, CandidateResult]) -> None:
    coarse, fine = outcomes["coarse"], outcomes["fine"]
    assert (len(coarse.cpu_s), len(fine.cpu_s)) == (3, 1)
    assert coarse.error("loss") == pytest.approx(8.3e-4, rel=0.01)
    assert set(coarse.errors) == {"loss", "gradient@stretch"}
    assert fine.error("gradient") < coarse.error("gradient") < 0.01
    assert np.isnan(fine.error("displacement"))
    assert fine.work == {"evaluations": 1001}
    assert 10 < coarse.peak_mib < 1000
    assert coarse.compile_s >= 0
    assert np.isnan(fine.spread)


def test_a_share_of_the_job_is_scaled() -> None:
    quarter = CandidateResult("one", cpu_s=(4.0, 8.0, 6.0))
    assert quarter.seconds == 6.0
    assert quarter.spread == pytest.approx(1 / 3)


def test_stored_numbers_have_errors_but_no_times() -> None:
    stored = Candidate("stored", toy_benchmark.exact, timed=False)
    found = measured(toy_benchmark.benchmark(stored))[0]["stored"]
    assert found.error("loss") == 0.0
    assert not found.cpu_s
    assert np.isnan(found.peak_mib)


@pytest.mark.parametrize(
    ("prepare", "reason"),
    [
        (toy_benchmark.raises_when_run, "ValueError: no such integral"),
        (toy_benchmark.raises_when_prepared, "ImportError: no such method"),
        (toy_benchmark.dies, "its process ended with code 3"),
    ],
)
def test_a_failed_candidate_is_listed_with_its_reason(prepare: object, reason: str) -> None:
    failing = Candidate("failing", prepare)  # type: ignore[arg-type]
    outcomes = measured(toy_benchmark.benchmark(failing), repeats=1)[0]
    assert outcomes["failing"].failure == reason
    assert outcomes["coarse"].cpu_s
    assert f"failing: no figures: {reason}" in text_table.text(report(outcomes))


def test_without_a_reference_nothing_is_measured() -> None:
    broken = Benchmark("broken", "", toy_benchmark.raises_when_prepared, ())
    with pytest.raises(CandidateError, match="no such method"):
        measure(broken, (), 1, lambda _: None)


def test_targets_are_met_missed_or_not_measured(outcomes: dict[str, CandidateResult]) -> None:
    verdicts = [verdict for _, _, verdict in report(outcomes).verdicts]
    assert verdicts == ["met", "missed", "met", "not measured"]


@pytest.mark.parametrize(
    ("target", "line"),
    [
        (Target("time", lambda _: 0.25, "s", at_most=0.8, aim=0.3), "<= 0.8 (aim 0.3): met"),
        (Target("faster", lambda _: 150.0, at_least=200), "150, target >= 200: missed"),
    ],
)
def test_target_lines(target: Target, line: str) -> None:
    assert line in text_table.target_line(target, *target.verdict({}))


def test_the_table_is_aligned(outcomes: dict[str, CandidateResult]) -> None:
    lines = text_table.table(list(outcomes.values())).splitlines()
    assert lines[0].split()[:3] == ["candidate", "time", "s"]
    assert "loss err" in lines[0]
    assert "gradient err" in lines[0]
    assert lines[3].endswith("1001 evaluations")


def test_reports_are_stored_and_stand_in_for_a_baseline(
    outcomes: dict[str, CandidateResult], tmp_path: Path
) -> None:
    json_path, csv_path = storage.write(report(outcomes), tmp_path)
    record = json.loads(json_path.read_text())
    assert record["machine"]["commit"] == MACHINE["commit"]
    assert record["targets"][3] == {
        "name": "speed", "unit": "", "value": None, "at_most": None, "at_least": 2, "aim": None,
        "verdict": "not measured",
    }  # fmt: skip
    with csv_path.open() as file:
        rows = list(csv.DictReader(file))
    assert [row["candidate"] for row in rows] == ["coarse", "fine"]
    assert float(rows[0]["loss error (relative)"]) == outcomes["coarse"].error("loss")

    again = storage.stored_outcomes("toy", tmp_path)["fine"]
    assert again.cpu_s == outcomes["fine"].cpu_s
    assert again.stored == "2026-01-01, abacus, commit 0123456789"
    assert "NOT measured now" in text_table.text(report({**outcomes, "fine": again}))


def test_nothing_stored_is_no_error(tmp_path: Path) -> None:
    assert storage.stored_outcomes("toy", tmp_path) == {}


def test_errors_are_relative() -> None:
    found = errors({"u": np.array([3.0, 4.4]), "extra": np.ones(1)}, {"u": np.array([3.0, 4.0])})
    assert found == {"u": pytest.approx(0.08)}


def test_every_suite_is_found_and_well_formed() -> None:
    assert {"fig2", "fig4", "precision"} <= set(registry.names())
    for benchmark in registry.load(registry.names()):
        names = [candidate.name for candidate in benchmark.candidates]
        assert len(set(names)) == len(names)
        assert all((t.at_most is None) != (t.at_least is None) for t in benchmark.targets)
        assert [verdict for *_, verdict in BenchmarkReport(benchmark, (), {}).verdicts] == [
            "not measured"
        ] * len(benchmark.targets)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["fig9"], "no benchmark 'fig9'; there are: fig2,"), (["--core", "4096"], "no core 4096")],
)
def test_mistakes_end_in_one_line(arguments: list[str], message: str) -> None:
    command = [sys.executable, "-m", "benchmarks", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: {message}")
    assert "Traceback" not in done.stderr
