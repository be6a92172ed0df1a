import dataclasses

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from pipeline.problem.sections import DIRECTIONS
from reports.base import style
from reports.facts import fact_records
from reports.figures import kinds
from reports.figures.shielding import facts, figure
from reports.figures.shielding.structure_panels import recorded_rows, simulated_rows, snapshot_times
from reports.study import RecordedMotion, StudyResults
from tests.reports import figure_assertions
from tests.reports.figure_assertions import texts


def drawn(study: StudyResults) -> Figure:
    with style.styled():
        return figure_assertions.drawn(figure.shielding_figure(study).draw())


@pytest.fixture(scope="module")
def whole(study: StudyResults) -> Figure:
    return drawn(study)


@pytest.mark.parametrize("preset", ["study", "quick"])
def test_it_is_legible_at_two_columns(preset: str, request: pytest.FixtureRequest) -> None:
    figure_assertions.assert_legible(drawn(request.getfixturevalue(preset)))


def test_panels_are_lettered_name_their_units_and_show_values(whole: Figure) -> None:
    words = {text.get_text() for text in texts(whole)}
    assert {*"abcde", "peak-to-peak −88.0 %", "0.824 mm", "0.0989 mm"} <= words
    assert "DRAFT" not in words
    labels = {axes.get_xlabel() for axes in whole.axes} | {axes.get_ylabel() for axes in whole.axes}
    assert {"Time $t$ (s)", "$u_y$ (mm)", "Frequency $f$ (Hz)", "Evaluation"} <= labels
    assert r"Loading angle $\alpha$ (°)" in labels


def test_a_loss_that_is_an_energy_has_its_unit(study: StudyResults) -> None:
    datasets = {kind: data.copy() for kind, data in study.datasets.items()}
    for kind, name in (("design", "best_loss"), ("response", "loss"), ("sweep", "loss")):
        datasets[kind][name].attrs["units"] = "N mm"  # type: ignore[index]
    by_energy = dataclasses.replace(study, datasets=datasets)
    labels = [axes.get_ylabel() for axes in drawn(by_energy).axes]
    assert labels.count("Loss $J$ (N mm)") == 2
    known = {fact.key: fact for fact in facts.shielding_facts(by_energy)}
    for key in ("loss_start", "loss_end", "best_sqp", "map_max", "map_min"):
        assert known[key].unit == "N mm"
        assert known[key].ours.endswith(" N mm")


@pytest.fixture(scope="module")
def faint(study: StudyResults) -> StudyResults:
    """The study at 1/90 of its amplitude, and its map up to 400 Hz."""
    datasets = {kind: data.copy(deep=True) for kind, data in study.datasets.items()}
    datasets["response"]["displacement"] /= 90.0
    for kind in ("design", "response", "sweep"):
        for name in datasets[kind]:
            if "loss" in str(name) and "error" not in str(name):
                datasets[kind][name] /= 8100.0
    datasets["sweep"]["value"].loc[{"parameter": "drive.frequency"}] *= 25.0
    return dataclasses.replace(study, datasets=datasets)


def test_a_study_of_small_motion_reads_in_digits_that_count(faint: StudyResults) -> None:
    made = drawn(faint)
    figure_assertions.assert_legible(made)
    words = {text.get_text() for text in texts(made)}
    assert {"0.00916 mm", "0.0011 mm"} <= words
    assert not words & {"0.000", "0.00 mm", "Robustness, largest $J$ = 0.000"}
    known = {fact.key: fact.ours for fact in facts.shielding_facts(faint)}
    assert known["best_sqp"] == "6.17 × 10⁻⁶"
    assert not [key for key, ours in known.items() if "loss" in key and float(ours.split()[0]) == 0]


def test_colours_of_the_snapshots_reach_as_far_as_the_motion(faint: StudyResults) -> None:
    made = drawn(faint)
    bar = next(axes for axes in made.axes if "mathbf{U}" in axes.get_ylabel())
    largest = max(
        float(np.linalg.norm(row.displacement / faint.scene.scale, axis=-1).max())
        for row in simulated_rows(faint.scene, faint.response)
    )
    assert bar.get_ylim()[1] <= 1.5 * largest


def test_the_map_has_few_ticks_over_any_range(faint: StudyResults, whole: Figure) -> None:
    for made, wanted in ((drawn(faint), range(0, 401, 100)), (whole, range(2, 17, 2))):
        axes = next(axes for axes in made.axes if axes.get_ylabel() == "Frequency $f$ (Hz)")
        low, high = axes.get_ylim()
        ticks = [tick for tick in axes.get_yticks() if low <= tick <= high]
        np.testing.assert_allclose(ticks, wanted)


def test_snapshots_are_near_the_peaks_of_one_cycle(study: StudyResults) -> None:
    altered, cloaked = simulated_rows(study.scene, study.response)
    np.testing.assert_allclose(altered.time, [1.525, 1.65, 1.775, 1.9], atol=1e-9)
    np.testing.assert_array_equal(altered.time, cloaked.time)
    assert altered.displacement.shape == (4, 225, 3)


def test_a_draft_says_so(quick: StudyResults) -> None:
    assert "DRAFT" in {text.get_text() for text in texts(drawn(quick))}
    assert "49 units instead of 225" in quick.draft
    assert "accuracy of the solver: draft" in quick.draft


def test_failed_points_of_the_map_are_crossed_out(study: StudyResults) -> None:
    sweep = study.sweep.copy(deep=True)
    there = 3 + 13 * 4  # the directions vary fastest
    sweep["loss"][there] = np.nan
    sweep["status"] = sweep["status"].astype(object)
    sweep["status"][there] = "no convergence at t = 0.1 s"
    made = drawn(dataclasses.replace(study, datasets=study.datasets | {"sweep": sweep}))
    crosses = [line for axes in made.axes for line in axes.lines if line.get_marker() == "x"]
    np.testing.assert_allclose(np.asarray(crosses[0].get_xydata()), [[45.0, 6.0]])


def test_a_map_without_any_result_says_so(study: StudyResults) -> None:
    sweep = study.sweep.copy(deep=True)
    for name in ("loss", "loss_altered"):
        sweep[name][:] = np.nan
    sweep["status"] = sweep["status"].astype(object)
    sweep["status"][:] = "no convergence at t = 0.1 s"
    failed = dataclasses.replace(study, datasets=study.datasets | {"sweep": sweep})
    assert "Robustness, no results" in {text.get_text() for text in texts(drawn(failed))}
    told = [fact for fact in facts.shielding_facts(failed) if fact.key.startswith("map_")]
    assert [(fact.key, fact.value) for fact in told] == [("map_failed", sweep.sizes["case"])]


@pytest.mark.parametrize("key", ["drive.frequency", DIRECTIONS])
def test_a_sweep_along_one_axis_is_no_map(study: StudyResults, key: str) -> None:
    sweep = study.problem.sweep
    assert sweep is not None
    assert sweep.grid is not None
    first = next(iter(sweep.values[key]))
    narrow = sweep.model_copy(update={"grid": {**sweep.grid, key: (first,)}})
    assert kinds.kind_of(study.problem) is kinds.SHIELDING
    asked = study.problem.model_copy(update={"sweep": narrow})
    assert kinds.kind_of(asked) is not kinds.SHIELDING


def test_a_study_of_no_paper_is_told_without_it(study: StudyResults) -> None:
    report = study.problem.report.model_copy(update={"paper": None})
    posed = study.problem.model_copy(update={"report": report})
    own = dataclasses.replace(study, problem=posed)
    for each, there in ((study, True), (own, False)):
        found = fact_records.quoted(facts.shielding_facts(each), each.problem.report.paper)
        text = figure.shielding_text(each, "", found)
        words = " ".join([text.credit, *(fact.note for fact in found)])
        notes = {fact.key: fact.note for fact in found}
        assert ("Bordiga" in words) == there
        assert ("paper" in words) == there
        assert ("their text" in notes["radius"]) == there


def test_recordings_are_shown_at_the_time_that_stands_above_them(study: StudyResults) -> None:
    """Save few samples: the nearest are elsewhere than the wanted times."""
    sparse = study.response.isel(time=slice(None, None, 7))
    times = simulated_rows(study.scene, sparse)[0].time
    assert np.abs(times - snapshot_times(study.scene, sparse)).max() > 1e-3
    along = sparse["time"].values
    data = xr.Dataset(
        {"measured": ("time", along)}, attrs={"structure": "cloaked", "case": 0, "synthetic": "no"}
    )
    recording = RecordedMotion("film", data, along, np.arange(len(along)), 0.9)
    (row,) = recorded_rows(study.scene, sparse, [recording], times)
    np.testing.assert_array_equal(row.time, times)
    np.testing.assert_allclose(row.displacement, times)
