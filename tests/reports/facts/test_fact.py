import csv
import json
from pathlib import Path

import numpy as np
import pytest

from reports.facts import Fact, fact_records
from reports.figures.shielding import monitored
from reports.figures.shielding.facts import shielding_facts
from reports.study import StudyResults
from tests.reports import shaken_study


@pytest.fixture(scope="module")
def found(study: StudyResults) -> dict[str, Fact]:
    return {fact.key: fact for fact in shielding_facts(study)}


def test_every_number_that_the_paper_quotes_is_there(found: dict[str, Fact]) -> None:
    quoted = {fact.paper for fact in found.values() if fact.paper != fact_records.ABSENT}
    assert {
        "15 × 15", "15 mm", "20°", "4.5 mm", "2 Hz", "0, 45, 90, 135°", "60 mm = 4 spacings",
        "≈ 150", "≈ 70 %", "5.2 mm", "1.9 mm", "63 %", "< 0.35", "0–180°", "2–16 Hz", "symmetric",
    } <= quoted  # fmt: skip


def test_keys_are_unique_and_everything_has_a_group(study: StudyResults) -> None:
    everything = shielding_facts(study)
    assert len({fact.key for fact in everything}) == len(everything)
    assert all(fact.group for fact in everything)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("bias", 20.0, "20°"),
        ("radius", 67.5, "67.5 mm = 4.5 spacings"),
        ("horizon", 1.0, "1 s"),
        ("mean_reduction", 88.0, "88.0 %"),
        ("mean_reduction_all", 88.0, "88.0 %"),
        ("peak_to_peak_reduction", 88.0, "88.0 %"),
        ("evaluations_sqp", 160, "160"),
        ("evaluations_mma", 60, "60"),
        ("kkt_sqp", 2e-4, "0.0002"),
        ("map_max", 0.05 + 0.06 * 1.25, "0.1250"),
        ("map_min", 0.05, "0.0500"),
        ("map_reduction", 100 * (1 - np.sqrt(1 / 20)), "77.6 %"),
        ("map_failed", 0, "0"),
        ("margin_edge_length", 0.0, "0 mm"),
        ("margin_void_angle", 0.0, "0°"),
        ("margin_block_angle", np.degrees(0.01), "0.573°"),
        ("gap", 0.11, "0.11 mm"),
        ("gap_motion", 0.08, "0.08 mm"),
        ("overlaps_motion", 0, "0"),
        ("loss_error", 3e-5, "3 × 10⁻⁵"),
        ("void_angle_motion", 0.0, "0°"),
    ],
)
def test_values(found: dict[str, Fact], key: str, value: float, words: str) -> None:
    assert found[key].value == pytest.approx(value, rel=1e-9, abs=1e-9)
    assert found[key].ours == words


def test_losses_are_weighted_means_of_both_forms(
    study: StudyResults, found: dict[str, Fact]
) -> None:
    loss = study.response["loss"].mean("case")
    assert found["loss_start"].value == pytest.approx(float(loss[0]))
    assert found["loss_end"].value == pytest.approx(float(loss[1]))
    ratio = found["loss_samples_end"].value / found["loss_end"].value
    assert ratio == pytest.approx(shaken_study.SAMPLES)


def test_peak_to_peak_is_that_of_the_middle_unit_at_45_degrees(
    study: StudyResults, found: dict[str, Fact]
) -> None:
    unit, case = 7 + 15 * 14, 1
    uy = study.response["displacement"].values[:, case, :, unit, 1]
    np.testing.assert_array_equal(monitored(study.scene, study.response), uy)
    assert found["peak_to_peak_altered"].value == pytest.approx(float(np.ptp(uy[0])))
    assert found["peak_to_peak_cloaked"].value == pytest.approx(float(np.ptp(uy[1])))
    assert found["peak_to_peak_altered_horizon"].value == pytest.approx(float(np.ptp(uy[0, :201])))


def test_cycles_are_named(found: dict[str, Fact]) -> None:
    assert "cycles 1 to 4" in found["peak_to_peak_altered"].label
    assert "cycles 1 to 2" in found["peak_to_peak_altered_horizon"].label


def test_wording_of_numbers() -> None:
    assert fact_records.worded(-0.25, "mm", 3) == "−0.25 mm"
    assert fact_records.worded(1.234e-7, "1", 2) == "1.2 × 10⁻⁷"
    assert fact_records.worded(1e-12, "mm", 3) == "0 mm"
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
