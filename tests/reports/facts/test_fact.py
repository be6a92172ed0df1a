import csv
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import problem
from reports.base import prose
from reports.facts import Fact, checks, constants_facts, fact_records
from reports.figures.shielding import monitored
from reports.figures.shielding.facts import shielding_facts
from reports.study import StudyResults
from sim.constraints import Limits
from sim.constraints.manufacturability import kinds
from sim.structure import SlotRoom, quads
from tests.pipeline.conftest import FIG2
from tests.reports import shaken_study
from tests.tables import cases


@pytest.fixture(scope="module")
def found(study: StudyResults) -> dict[str, Fact]:
    return {fact.key: fact for fact in shielding_facts(study)}


def test_quoted_numbers_are_there_once(study: StudyResults, found: dict[str, Fact]) -> None:
    everything = shielding_facts(study)
    assert len(everything) == len(found)
    assert all(fact.group for fact in everything)
    quoted = {fact.paper for fact in found.values() if fact.paper != fact_records.ABSENT}
    assert {
        "15 × 15", "15 mm", "20°", "4.5 mm", "2 Hz", "0, 45, 90, 135°", "60 mm = 4 spacings",
        "≈ 150", "≈ 70 %", "5.2 mm", "1.9 mm", "63 %", "< 0.35", "0–180°", "2–16 Hz", "symmetric",
    } <= quoted  # fmt: skip


@cases("reports", "key, value, words")
def test_values(found: dict[str, Fact], key: str, value: float, words: str) -> None:
    assert found[key].value == pytest.approx(value, rel=1e-9, abs=1e-9)
    assert found[key].ours == words


def test_both_losses_are_weighted_means(study: StudyResults, found: dict[str, Fact]) -> None:
    loss = study.response["loss"].mean("case")
    assert found["loss_start"].value == pytest.approx(float(loss[0]))
    assert found["loss_end"].value == pytest.approx(float(loss[1]))
    ratio = found["loss_samples_end"].value / found["loss_end"].value
    assert ratio == pytest.approx(shaken_study.SAMPLES)


def test_peak_to_peak_of_the_middle_unit(study: StudyResults, found: dict[str, Fact]) -> None:
    unit, case = 7 + 15 * 14, 1
    uy = study.response["displacement"].values[:, case, :, unit, 1]
    np.testing.assert_array_equal(monitored(study.scene, study.response), uy)
    assert found["peak_to_peak_altered"].value == pytest.approx(float(np.ptp(uy[0])))
    assert found["peak_to_peak_cloaked"].value == pytest.approx(float(np.ptp(uy[1])))
    assert found["peak_to_peak_altered_horizon"].value == pytest.approx(float(np.ptp(uy[0, :201])))
    assert "cycles 1 to 4" in found["peak_to_peak_altered"].label
    assert "cycles 1 to 2" in found["peak_to_peak_altered_horizon"].label


def test_wording_of_numbers() -> None:
    assert fact_records.worded(-0.25, "mm", 3) == "−0.25 mm"
    assert fact_records.worded(1.234e-7, "1", 2) == "1.2 × 10⁻⁷"
    assert fact_records.worded(1e-12, "mm", 3) == "0 mm"
    assert (
        fact_records.worded(2.5e-11, "N mm", 3) == "2.5 × 10⁻¹¹ N mm"
    )  # of a thousandth of a load
    assert fact_records.worded(1e-20, "N mm", 3) == "0 N mm"
    assert fact_records.within(1e-12, "mm", 2) == "below 1 × 10⁻⁹ mm"
    assert fact_records.within(0.012, "mm", 2) == "0.012 mm"
    assert fact_records.percent(0.8512) == "85.1 %"


def test_files_hold_the_same_facts(tmp_path: Path, study: StudyResults) -> None:
    known = [*shielding_facts(study), fact_records.number("lost", "Lost", float("nan"))]
    fact_records.write_json(known, tmp_path / "facts.json")
    (tmp_path / "facts.csv").write_bytes(fact_records.table(known).csv)
    records = json.loads((tmp_path / "facts.json").read_text(encoding="utf-8"))
    with (tmp_path / "facts.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [record["ours"] for record in records] == [row["ours"] for row in rows]
    assert records[-1]["value"] is None
    assert rows[-1]["value"] == ""
    assert records[0] == {
        "key": "units", "label": "Units", "value": 225, "unit": "1", "ours": "15 × 15",
        "paper": "15 × 15", "note": "", "group": "Scene",
    }  # fmt: skip


def test_every_kind_of_constraint_has_a_name() -> None:
    room = SlotRoom(1.0, 5.0, 0.45, 0.8, 0.1)
    limits = Limits(5.0, 0.5, True, 0.0, 0.2, room, 0.5)
    assert None not in (getattr(limits, name) for name in Limits.__dataclass_fields__)
    found = {kind.name for kind in kinds(quads(3, 3, 15.0, 2.25, np.deg2rad(20.0)), limits)}
    told = prose(checks.__file__)
    assert {f"margin_{name}" for name in found} == {
        key for key in told if key.startswith("margin_")
    }


def losses(cloaked: list[float], altered: list[float]) -> xr.Dataset:
    """Of draws of measured constants."""
    status = np.where(np.isfinite(cloaked), "ok", "no equilibrium")
    named = {"loss": cloaked, "loss_altered": altered, "status": status}
    return xr.Dataset({name: ("case", values) for name, values in named.items()})


def test_mean_and_interval_over_measured_constants_leave_failed_draws_out() -> None:
    asked, made = problem.load(FIG2), losses([0.1, 0.2, np.nan], [1.0, 1.0, np.nan])
    start, end, gain = constants_facts(asked, made, (1.0, 0.1))
    np.testing.assert_allclose([start.value, end.value, gain.value], [1.0, 0.15, 85.0])
    assert end.ours == "0.15 (0.103 to 0.198)"
    assert end.note == "nominal 0.1; mean and 95 % of 3 draws, 1 of them failed"
    assert gain.note.startswith("nominal 90.0 %")
    assert list(constants_facts(asked, None, (1.0, 0.1))) == []
    (only,) = constants_facts(asked, losses([np.nan], [np.nan]), (1.0, 0.1))
    assert (only.ours, only.note) == ("none", "no equilibrium")
