import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure

from reports.base import style
from reports.figures.shielding import facts, figure
from reports.figures.shielding.structure_panels import simulated_rows
from reports.study import StudyResults
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
    assert {*"abcde", "peak-to-peak −88.0 %", "0.82 mm", "0.10 mm"} <= words
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
