"""The benchmarks' frame on a toy suite; nothing is asserted about times but that there are some."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import __main__ as command
from benchmarks.harness import (
    CandidateError,
    Measurement,
    MeasuringLimits,
    Method,
    Suite,
    Target,
    comparison,
    errors,
    in_turn,
    measure_settings,
    storage,
    text_table,
)
from benchmarks.suites import suites
from pipeline import datasets
from tests.benchmarks import toy_benchmark
from tests.tables import cases

ABOUT = {"processor": "abacus", "core": 0, "commit": "0123456789abcdef"}
ABOUT |= {"date": "2026-01-01T00:00", "changed_since_commit": []}
SETTINGS = (("10 points", 11.0), ("1000 points", 1001.0))


def measured(suite: Suite, repeats: int = 3) -> tuple[list[Measurement], list[str]]:
    told: list[str] = []
    found = suite.measure(MeasuringLimits(repeats), told.append)
    assert isinstance(found, list)
    return found, told


@pytest.fixture(scope="module")
def toy() -> tuple[list[Measurement], list[str]]:
    return measured(toy_benchmark.suite(Method("stored", toy_benchmark.exact, timed=False)))


def test_methods_run_in_turn(toy: tuple[list[Measurement], list[str]]) -> None:
    rounds = [line.rpartition(":")[0] for line in toy[1] if "round" in line]
    turns = ("1 of 3: coarse", "1 of 3: fine", "1 of 3: stored", "2 of 3: coarse", "3 of 3: coarse")
    assert rounds == [f"round {turn}" for turn in turns]


def test_measured_times_errors_work_and_memory(toy: tuple[list[Measurement], list[str]]) -> None:
    lost = Measurement("one", cpu_s=(1.0,), errors={"loss@0": 1e-6, "loss@5": np.nan})
    assert np.isnan(lost.error("loss"))
    one = Measurement("one", cpu_s=(4.0, 8.0, 6.0))
    assert [one.seconds, one.spread] == pytest.approx([6.0, 1 / 3])
    found = errors({"u": np.array([3.0, 4.4]), "extra": np.ones(1)}, {"u": np.array([3.0, 4.0])})
    assert found == {"u": pytest.approx(0.08)}
    coarse, fine, stored = toy[0]
    assert (len(coarse.cpu_s), len(fine.cpu_s)) == (3, 1)
    assert coarse.error("loss") == pytest.approx(8.3e-4, rel=0.01)
    assert set(coarse.errors) == {"loss", "gradient@stretch"}
    assert fine.error("gradient") < coarse.error("gradient") < 0.01
    assert np.isnan(fine.error("displacement"))
    assert fine.work == {"evaluations": 1001}
    assert 10 < coarse.peak_mib < 1000
    assert coarse.compile_s >= 0
    assert np.isnan(fine.spread)
    assert stored.error("loss") == 0.0
    assert not stored.cpu_s
    assert np.isnan(stored.peak_mib)


@pytest.mark.parametrize(
    ("prepare", "reason"),
    [
        (toy_benchmark.raises_when_run, "ValueError: no such integral"),
        (toy_benchmark.raises_when_prepared, "ImportError: no such method"),
        (toy_benchmark.dies, "its process ended with code 3"),
    ],
)
def test_a_failed_method_is_listed_with_its_reason(prepare: object, reason: str) -> None:
    suite = toy_benchmark.suite(Method("failing", prepare))  # type: ignore[arg-type]
    found, _ = measured(suite, repeats=1)
    assert found[2].failure == reason
    assert found[0].cpu_s
    assert f"failing: no figures: {reason}" in text_table.text(suite, found, ABOUT)


def test_without_a_reference_nothing_is_measured() -> None:
    broken = in_turn("broken", "", ("", toy_benchmark.raises_when_prepared), (), (), 0)
    with pytest.raises(CandidateError, match="no such method"):
        measured(broken)


def test_targets_and_the_table_are_told(toy: tuple[list[Measurement], list[str]]) -> None:
    verdicts = [verdict for *_, verdict in toy_benchmark.suite().verdicts(toy[0])]
    assert verdicts == ["met", "missed", "met", "not measured"]
    for target, line in (
        (Target("time", lambda _: 0.25, "s", at_most=0.8, aim=0.3), "<= 0.8 (aim 0.3): met"),
        (Target("faster", lambda _: 150.0, at_least=200), "150, target >= 200: missed"),
    ):
        assert line in text_table.target_line(target, *target.verdict({}))
    lines = text_table.table(toy[0]).splitlines()
    assert lines[0].split()[:3] == ["candidate", "time", "s"]
    assert "loss err" in lines[0]
    assert "gradient err" in lines[0]
    assert lines[3].endswith("1001 evaluations")


def test_stored_measurements(toy: tuple[list[Measurement], list[str]], tmp_path: Path) -> None:
    suite, fine = toy_benchmark.suite(), toy[0][1]
    path = storage.write(suite, toy[0], ABOUT, {"repeats": 3}, tmp_path)
    data = datasets.read(path, "benchmark")
    assert json.loads(data.attrs["machine"])["commit"] == ABOUT["commit"]
    assert json.loads(data.attrs["targets"])[3] == {
        "name": "speed", "unit": "", "value": None, "at_most": None, "at_least": 2, "aim": None,
        "verdict": "not measured",
    }  # fmt: skip
    again = storage.stored_measurements(path, suite.baselines)
    assert list(again) == ["fine"]
    assert replace(again["fine"], note="", errors={}) == replace(fine, note="", errors={})
    assert again["fine"].error("gradient") == fine.error("gradient")
    stored = MeasuringLimits(1, skipped=suite.baselines, stored=again)
    found = suite.measure(stored, lambda _: None)
    assert isinstance(found, list)
    told = text_table.text(suite, found, ABOUT)
    assert "fine: scaled; NOT measured now, figures of 2026-01-01" in told
    assert storage.stored_measurements(tmp_path / "none.nc", suite.baselines) == {}


def climbed(
    prepare: object, settings: tuple[tuple[str, float], ...] = SETTINGS
) -> list[Measurement]:
    method = Method("trapezoids", prepare, settings, tasks=("loss",))  # type: ignore[arg-type]
    reference = toy_benchmark.exact()().values
    limits = MeasuringLimits(repeats=3, limit_s=0.5)
    return measure_settings(method, reference, 4, limits, lambda _: None)


def test_every_setting_is_measured_and_stored_with_units(tmp_path: Path) -> None:
    coarse, fine = climbed(toy_benchmark.trapezoids)
    assert (coarse.setting, fine.setting) == ("10 points", "1000 points")
    assert len(coarse.cpu_s) == 3
    assert fine.error("loss") < coarse.error("loss") / 1000
    assert fine.work == {"evaluations": 1001}
    failed = Measurement("rule", "c", "loss", False, units=4, failure="no such method")
    path = storage.write(toy_benchmark.suite(), [coarse, fine, failed], ABOUT, {}, tmp_path)
    read = datasets.read(path, "benchmark")
    assert read["cpu_time"].attrs["units"] == "s"
    assert read["outcome"].values.tolist() == ["measured", "measured", "no such method"]
    assert np.isnan(read["error"].sel(quantity="loss").values).tolist() == [False, False, True]
    assert read["own"].values.tolist() == [1, 1, 0]


def test_what_takes_too_long_is_ended_what_fails_is_told_and_others_go_on() -> None:
    settings = (("a", 0.0), ("b", 1.0), ("c", 2.0))
    fast, slow, never = climbed(toy_benchmark.slow_at_setting, settings)
    assert fast.cpu_s
    assert slow.failure == "took longer than 0.5 s"
    assert never.failure == "not tried: b took longer than 0.5 s"
    failed, fine = climbed(toy_benchmark.fails_at_first, (("a", 0.0), ("b", 11.0)))
    assert failed.failure == "ArithmeticError: too loose"
    assert fine.cpu_s


def test_short_suites_are_chosen_and_every_one_can_be() -> None:
    assert [suite.name for suite in suites([])] == ["fig2", "fig4", "precision", "warm"]
    for suite in suites(["static", "growth", "ablation", "tracking", "optimisers_fig5"]):
        assert all((t.at_most is None) != (t.at_least is None) for t in suite.targets)
        assert {verdict for *_, verdict in suite.verdicts([])} <= {"not measured"}


@pytest.mark.parametrize(
    ("arguments", "message"), [(["fig9"], "no such suite"), (["--core", "4096"], "no core 4096")]
)
def test_mistakes(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(arguments) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"error: {message}")
    assert "Traceback" not in told


@cases("benchmarks", "seconds, error, lines")
def test_more_than_15_percent_is_told(seconds: float, error: float, lines: list[str]) -> None:
    before = recorded(1.0, 1e-3, yard=0.5)
    # the second machine is half as fast: its seconds are twice as many
    assert comparison.find_regressions(recorded(seconds, error, yard=1.0), before) == lines
    rounding = recorded(1.0, 1e-14, 1.0), recorded(1.0, 1e-16, 1.0)
    assert comparison.find_regressions(*rounding) == []


def test_figures_that_are_gone_are_told() -> None:
    fine = Measurement("fine", cpu_s=(1.0,), errors={"loss": 1e-3, "gradient": 1e-3})
    before = comparison.record([fine, Measurement("long", cpu_s=(9.0,))], ABOUT, 1.0)
    lost = comparison.record([replace(fine, errors={"loss": np.nan})], ABOUT, 1.0)
    assert json.loads(json.dumps(lost, allow_nan=False)) == lost
    assert comparison.find_regressions(lost, before, skipped=("long",)) == [
        "fine: loss has no figure any more",
        "fine: gradient has no figure any more",
    ]
    assert comparison.find_regressions(before, lost) == []
    failed = comparison.record([replace(fine, cpu_s=(), failure="no equilibrium")], ABOUT, 1.0)
    gone = [f"{name}: no figures any more" for name in ("fine", "long")]
    assert comparison.find_regressions(failed, before) == gone


def test_an_energy_that_is_no_number_meets_no_target() -> None:
    (static,) = suites(["static"])
    target = next(target for target in static.targets if target.name == "energy error")
    good = Measurement("15 x 15", cpu_s=(1.0,), errors={"energy@15": 1e-15})
    for lost in (replace(good, errors={"energy@120": np.nan}), Measurement("x", failure="none")):
        assert target.verdict({"small": good, "large": lost})[1] == "not measured"
    assert target.verdict({"small": good}) == (1e-15, "met")


def recorded(seconds: float, error: float, yard: float) -> comparison.Record:
    misses = {"loss@a": error, "loss@b": error / 2}
    made = [Measurement("coarse", cpu_s=(seconds,), errors=misses), Measurement("x", failure="no")]
    return comparison.record(made, ABOUT, yard)


def test_a_record_is_kept_with_machine_and_commit(tmp_path: Path) -> None:
    path, made = tmp_path / "kept.json", recorded(1.0, 1e-3, yard=0.5)
    assert 1e-4 < comparison.yardstick() < 10
    assert "nothing stored" in comparison.comparison_text("toy", made, path)
    comparison.keep("toy", made, path)
    assert comparison.read_records(path) == {"toy": made}
    assert made["candidates"] == {"coarse": {"time": 2.0, "errors": {"loss": 1e-3}}}
    assert "abacus, commit 0123456789" in comparison.comparison_text("toy", made, path)
