import dataclasses
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from pipeline.posing import law_comparison
from pipeline.problem.sections import Method
from reports.base import style
from reports.facts import checks
from reports.facts.copies import in_words
from reports.figures import kinds
from reports.figures.loading_path import (
    abscissa,
    curves,
    figure,
    measures,
    monte_carlo,
    snapshot_grid,
)
from reports.figures.loading_path import facts as path_facts
from reports.figures.loading_path.structure_panels import UnitColouring
from reports.figures.shielding import facts as shielding
from reports.figures.study_report import study_report
from reports.figures.wave.figure import wave_figure
from reports.page import publish
from reports.panels import ColourField, PanelFigure, payload
from reports.study import StudyResults
from tests.reports import figure_assertions, recorded_study
from tests.reports.loading_paths import changed, made, values
from tests.tables import some


def test_kinds_of_reports(study: StudyResults, shield: StudyResults, smile: StudyResults) -> None:
    assert kinds.kind_of(study.problem).facts is shielding.shielding_facts
    without = study.problem.model_copy(update={"sweep": None})
    assert study.problem.cloak.disc is not None
    aside = study.problem.cloak.disc.model_copy(update={"centre": (30.0, 30.0)})
    cloak = study.problem.cloak.model_copy(update={"disc": aside})
    off_centre = study.problem.model_copy(update={"cloak": cloak})
    for problem in (without, off_centre, shield.problem, smile.problem):
        assert kinds.kind_of(problem).facts is path_facts.loading_path_facts


def test_recordings_are_placed_and_have_the_only_bands(smile: StudyResults, tmp_path: Path) -> None:
    shown = recorded_study.with_recordings(smile, tmp_path, ("altered", 0), ("cloaked", 0))
    bands = "hold 90 % of the imperfect cloaks"
    assert bands in figure.loading_path_figure(smile).caption
    told = figure.loading_path_figure(shown).caption
    assert "The experiment is shown left of its simulation" in told  # six columns
    assert bands not in told
    path = abscissa.abscissa_of(smile.problem, smile.response)
    measure = measures.measure_of(smile.problem)
    counts = []
    for study in (smile, shown):
        axes = Figure().add_subplot()
        curves.measure_panel(axes, study, path, measure)
        counts.append(len(axes.collections))
    assert counts == [len(monte_carlo.DRAWN) + 1, 2]  # two sizes of geometry; one band a recording


@pytest.mark.parametrize("compose", [figure.loading_path_figure, wave_figure])
def test_captions_name_the_imperfections_that_are_drawn(
    smile: StudyResults, compose: Callable[[StudyResults], PanelFigure]
) -> None:
    """Say of the others that they stand in tables, where bands are and where rows are."""
    assert smile.scatter is not None
    named = ["geometry 5 %", "together 0.1 mm, 5 %", "common 10 %"]
    some = smile.scatter.isel(noise=range(len(named))).assign_coords(noise=named)
    told = compose(changed(smile, "scatter", some)).caption
    drawn = f"{in_words(named[0])}, {in_words(named[1])}"
    left = f"{in_words(named[2])} stand in the tables alone"
    assert f"hold 90 % of the imperfect cloaks, each of one kind: {drawn}; {left}" in told
    few = compose(changed(smile, "scatter", some.isel(noise=[0]))).caption
    assert "stand in the tables" not in few
    if compose is not wave_figure:
        assert f"over imperfect cloaks, {drawn}: median" in told


def test_bands_are_of_the_structures_that_are_drawn(smile: StudyResults, tmp_path: Path) -> None:
    """Leave the intact one without, whose measure is zero; its contraction has a band."""
    shown = recorded_study.with_recordings(smile, tmp_path, ("intact", 0), ("cloaked", 0))
    path = abscissa.abscissa_of(smile.problem, smile.response)
    measure = measures.measure_of(smile.problem)
    first, second = (Figure().add_subplot() for _ in range(2))
    curves.measure_panel(first, shown, path, measure)
    curves.contraction_panel(second, shown, path)
    assert [len(axes.collections) for axes in (first, second)] == [1, 2]


def test_the_error_of_a_reaction_stands_beside_the_title(smile: StudyResults) -> None:
    path, axes = abscissa.abscissa_of(smile.problem, smile.response), Figure().add_subplot()
    curves.drive_panel(axes, smile, path)
    (told,) = axes.texts
    assert told.get_text().startswith("cloaked: RMS ")
    assert told.get_window_extent().y0 > axes.get_window_extent().y1
    assert "; RMS, how far" in figure.loading_path_figure(smile).caption


@pytest.mark.parametrize("name", some(["smile", "shield"], 1))
def test_the_figure_is_legible(name: str, request: pytest.FixtureRequest) -> None:
    figure_assertions.assert_legible(made(request.getfixturevalue(name)))


@pytest.mark.parametrize("name", some(["smile", "shield"], 1))
@pytest.mark.parametrize("factor", [1e-4, 1e5])
def test_the_figure_is_legible_of_very_small_and_large_loads(
    name: str, factor: float, request: pytest.FixtureRequest
) -> None:
    """Motions are small too, of which wide numbers would push labels off the page."""
    study = request.getfixturevalue(name)
    factors = {"reaction_force": factor, "eigenvalue": factor}
    factors |= dict.fromkeys(("displacement", "drive_displacement"), min(factor, 1.0))
    response = study.response.assign({key: by * study.response[key] for key, by in factors.items()})
    losses = ("loss", "loss_case", "best_loss")
    design = study.design.assign({key: factor * study.design[key] for key in losses})
    figure_assertions.assert_legible(
        made(changed(changed(study, "response", response), "design", design))
    )


def test_the_figure_names_structures_units_and_the_papers_label(shield: StudyResults) -> None:
    words = figure_assertions.words(made(shield))
    assert {"Uncloaked", "Cloaked", "Unloaded: zero", "Paper’s label ε (%)", "Force (N)"} <= words
    assert set("abcdef") <= words
    drafted = dataclasses.replace(shield, draft=("9 units instead of 225",))
    assert "DRAFT" in figure_assertions.words(made(drafted))
    assert "DRAFT" not in words


@pytest.mark.slow
def test_a_second_design_is_drawn_and_a_kept_one_not(shield: StudyResults) -> None:
    assert values(shield)["second_design"].ours == "optimised again, 6 evaluations"
    assert values(shield)["second_rotation_reduction"].value == pytest.approx(90.0)
    assert values(shield)["second_overlaps"].value == 1
    assert values(shield)["jumps_second_design"].value == 0
    measure = made(shield).axes[-4]
    assert "Cloaked, no overlap" in {line.get_label() for line in measure.lines}
    assert "dashed" in figure.loading_path_figure(shield).caption
    whole = shield.datasets["geometric_design"].assign(best_evaluation=("method", [0]))
    alone = whole.isel(evaluation=slice(1))
    kept = changed(shield, "geometric_design", alone)
    assert values(kept)["second_design"].ours.startswith("the same")
    assert "contact_angle_second" not in values(kept)
    assert "dashed purple" not in figure.loading_path_figure(kept).caption
    lines = [line.get_label() for axes in made(kept).axes for line in axes.lines]
    assert "Cloaked, no overlap" not in lines


def test_a_jump_is_marked_and_a_snap_is_a_headline(shield: StudyResults) -> None:
    response = shield.response.copy(deep=True)
    response["stability"][1, 0, 4] = checks.JUMPED
    jumped = changed(shield, "response", response)
    assert values(jumped)["jumps_cloaked"].value == 1
    assert values(jumped)["jumps_altered"].value == 0
    lines = [line for axes in made(jumped).axes for line in axes.lines]
    crosses = [line for line in lines if line.get_marker() == "x"]
    points = np.concatenate([np.asarray(line.get_xydata()) for line in crosses])
    np.testing.assert_allclose(points, [[7.5, 0.1 * values(shield)["rotation_altered"].value / 2]])
    assert "crosses mark jumps" in figure.loading_path_figure(jumped).caption
    assert "crosses" not in figure.loading_path_figure(shield).caption
    assert "snaps" not in values(shield)
    response = shield.response.copy(deep=True)
    response["snap"][1, 0, 4] = float(response["time"][4])
    told = changed(shield, "response", response)
    assert values(told)["snaps"].ours == "snaps at 7.5 mm: 0.05 N mm"
    response["stability"][1, 0, 4] = 3
    told = changed(shield, "response", response)
    assert values(told)["snaps"].note.endswith("the branch that it was followed along")
    response["loss_other_branch"][1, 0] = 0.07
    assert values(told)["snaps"].ours == "snaps at 7.5 mm: 0.05 N mm or 0.07 N mm"
    text = figure.loading_path_text(told, "", list(values(told).values()))
    assert "snaps" in {fact.key for fact in text.headline}


def test_several_snaps_and_the_path_that_they_leave_are_told(shield: StudyResults) -> None:
    response, end = shield.response, float(shield.response["time"][-1])
    shape, points = (2, 1), np.array([0.4, 0.5, 0.3, 0.6, 1.0]) * end
    snaps, traced = np.full((*shape, 2), np.nan), np.full((*shape, 5), np.nan)
    snaps[1, 0], traced[1, 0] = [0.5 * end, 0.8 * end], points
    force = np.zeros((*shape, 5, 2))
    force[1, 0, :, 0] = -points
    of_case = ("structure", "case")
    response = response.drop_vars([name for name in response if str(name).startswith("traced")])
    response = response.assign(
        snap_load=((*of_case, "snap_number"), snaps),
        traced_load=((*of_case, "traced_point"), traced),
        traced_eigenvalue=((*of_case, "traced_point"), traced),
        traced_force=((*of_case, "traced_point", "xy"), force),
    )
    told = changed(shield, "response", response)
    fact = values(told)["snaps"]
    assert fact.ours == "snaps at 7.5 mm and 12 mm: 0.05 N mm"
    assert "turns at 7.5 mm and 4.5 mm" in fact.note
    curves = [line.get_xydata() for axes in made(told).axes for line in axes.lines]
    wanted = np.column_stack([15.0 * points / end, points])
    assert any(np.shape(each) == wanted.shape and np.allclose(each, wanted) for each in curves)


def test_absent_units_are_not_in_the_player(smile: StudyResults) -> None:
    intact, voided, _ = payload(figure.loading_path_animation(smile))["structures"]
    count = [len(part["owner"]) for part in (intact, voided)]
    assert count[0] - count[1] == pytest.approx(18 * 4 * 4 * 4 / 3, abs=4)  # base64 of int32
    assert voided["name"] == "Voided"


@pytest.mark.slow
def test_a_motion_in_time_has_a_report_of_its_own(study: StudyResults, tmp_path: Path) -> None:
    plain = dict(study.datasets)
    del plain["sweep"]
    without = study.problem.model_copy(update={"sweep": None})
    publish(study_report(dataclasses.replace(study, problem=without, datasets=plain)), tmp_path)
    columns = (tmp_path / "path.csv").read_text(encoding="utf-8").partition("\n")[0].split(",")
    assert "altered_motion" in columns
    assert "displacement_mm" not in columns
    curve = np.genfromtxt(tmp_path / "path.csv", delimiter=",", names=True)["altered_motion"]
    told = json.loads((tmp_path / "facts.json").read_text(encoding="utf-8"))
    (found,) = [fact["value"] for fact in told if fact["key"] == "motion_altered"]
    assert found == pytest.approx(np.sqrt(np.mean(curve**2)), rel=1e-4)  # not that at its end


@pytest.mark.slow
def test_the_page_is_whole(shield: StudyResults, tmp_path: Path) -> None:
    names = {path.name for path in publish(study_report(shield), tmp_path)}
    assert {"path.csv", "robustness.csv", "facts.json", "index.html"} <= names
    html = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "After Figure 4 of Bordiga et al." in html
    assert "as run" in html
    assert "vertices off by up to ±3 % of s (5 copies)" in html
    assert len(html.encode()) < 6_000_000
    robust = html.split('<table class="robust">')[1].split("</table>")[0]
    cells = re.findall(r'<td class="ours" data-label="([^"]+)">[^<]+</td>', robust)
    of = ("Mean |θ| in the region of interest", "Loss")
    once = [label for each in of for label in (f"{each}: nominal, or median", "95 % keep below")]
    assert cells == once * (len(cells) // 4)


def test_evaluations_that_are_not_drawn_are_told(smile: StudyResults) -> None:
    """Adds a stage by the angle law, and two descents to that which is drawn."""
    assert "not drawn" not in figure.loading_path_figure(smile).caption
    asked = smile.problem.with_optimiser(angle=Method(evaluations=7))
    plan = json.dumps({"descents": [0.1, 0.05, None]})
    searched = changed(smile, "design", smile.design.assign_attrs(plan=plan))
    searched = dataclasses.replace(searched, problem=law_comparison.under(asked, "geometric"))
    told = figure.loading_path_figure(searched).caption
    assert "up to 7 evaluations by the angle law of contact, which are not drawn." in told
    assert "Of its 3 descents the best is drawn." in told
    found = {fact.key: fact for fact in checks.history_facts(searched.problem, searched.design)}
    assert "counted from the end of those by the angle law" in found["evaluations_sqp"].note
    each = 7 + asked.optimiser.methods.chosen["sqp"].evaluations
    assert f"up to {each} evaluations each, {3 * each} in all" in found["descents"].note


@pytest.mark.parametrize("most", [0.03, 0.3, 3.0, 12.0])
def test_the_label_of_the_bar_is_not_cut(most: float) -> None:
    """At the right edge of a figure as wide as a page."""
    field = ColourField("size", "|U|", "1", 1.0, "magnitude", (0.0, most))
    shade = UnitColouring(field, r"$\|\mathbf{U}\|$", style.MAGNITUDE)
    with style.styled():
        made = style.page(110.0)
        left = style.TWO_COLUMNS - snapshot_grid.BAR + 1.5
        snapshot_grid.shade_bar(made, shade, (left, 10.0, 90.0))
        made.draw_without_rendering()
        (bar,) = made.axes
        assert bar.yaxis.label.get_window_extent().x1 < made.bbox.x1
