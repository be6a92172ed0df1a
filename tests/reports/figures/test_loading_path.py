import dataclasses
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from pipeline.posing import law_comparison
from pipeline.problem import Output
from pipeline.problem.sections import Method, Methods, Paper, TanhRampDrive
from reports.facts import checks, fact_records, loss_formula
from reports.facts.copies import in_words, spreads
from reports.figures import kinds
from reports.figures.loading_path import (
    abscissa,
    curves,
    figure,
    measures,
    monte_carlo,
    tables,
)
from reports.figures.loading_path import facts as path_facts
from reports.figures.robust_table import robust_table
from reports.figures.shielding import facts as shielding
from reports.figures.study_report import as_built_facts, study_report
from reports.figures.wave.figure import wave_figure
from reports.page import publish
from reports.panels import PanelFigure, payload
from reports.study import StudyResults
from tests.reports import figure_assertions, recorded_study
from tests.reports.loading_paths import made, values
from tests.tables import refused, some


def changed(study: StudyResults, name: Output, made: xr.Dataset) -> StudyResults:
    return dataclasses.replace(study, datasets={**study.datasets, name: made})


def test_kinds_of_reports(study: StudyResults, shield: StudyResults, smile: StudyResults) -> None:
    assert kinds.kind_of(study.problem).facts is shielding.shielding_facts
    without = study.problem.model_copy(update={"sweep": None})
    assert study.problem.cloak.disc is not None
    aside = study.problem.cloak.disc.model_copy(update={"centre": (30.0, 30.0)})
    cloak = study.problem.cloak.model_copy(update={"disc": aside})
    off_centre = study.problem.model_copy(update={"cloak": cloak})
    for problem in (without, off_centre, shield.problem, smile.problem):
        assert kinds.kind_of(problem).facts is path_facts.loading_path_facts


def test_copies_without_a_reaction_have_no_column_of_it(smile: StudyResults) -> None:
    assert smile.scatter is not None
    assert "reaction_N" in tables.copies(smile, smile.scatter)
    unknown = smile.scatter.assign(reaction=np.nan * smile.scatter["reaction"])
    assert "reaction_N" not in tables.copies(smile, unknown)


def test_a_loss_has_its_formula(
    study: StudyResults, shield: StudyResults, smile: StudyResults
) -> None:
    """Each over the region of interest, what is left of them told by their problems."""
    told = {
        "mean over the time of ‖U‖²": study,
        "mean over the load steps of the strain energy": shield,
        "sum over the load steps of ‖U − U₀‖², divided by ‖U₀‖ at full load": smile,
    }
    for words, one in told.items():
        for key in ("loss_start", "loss_end"):
            note = {fact.key: fact.note for fact in kinds.kind_of(one.problem).facts(one)}[key]
            assert words in note
            assert ("mean of the load cases" in note) == (one is study)
    intact = smile.problem.objective
    asked = smile.problem.model_copy(
        update={
            "objective": intact.model_copy(update={"reaction": 0.5}),
            "horizon": smile.problem.horizon.model_copy(update={"steps": None}),
        }
    )
    formula = loss_formula(asked)
    assert "mean over the time of ‖U − U₀‖², divided by max ‖U₀‖," in formula
    assert formula.endswith("; of the motion alone, without the drive’s force")
    facts = checks.history_facts(asked, smile.design)
    best = next(fact for fact in facts if fact.key.startswith("best_"))
    assert best.note.endswith("; plus 0.5 times the relative error of the drive’s force")


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


def test_a_cloak_is_as_wide_as_where_it_is_narrowest(
    shield: StudyResults, smile: StudyResults
) -> None:
    """Between circles, and between the smile's corners and a circle about the middle of it."""
    assert values(shield)["cloak_width"].value == pytest.approx(91.0 - 67.5)
    narrowest = values(smile)["cloak_width"]
    assert narrowest.value == pytest.approx(73.5 - np.hypot(60.0, 15.0))
    assert narrowest.note == "0.7769 spacings, where it is narrowest"


def test_the_axis_is_the_displacement_of_the_driven_units(shield: StudyResults) -> None:
    way = abscissa.abscissa_of(shield.problem, shield.response)
    np.testing.assert_allclose(way.values, np.linspace(0, 15, 9), atol=1e-12)
    assert [way.at(k) for k in way.shown] == [
        "0 mm (0 %)", "5.62 mm (3.8 %)", "11.2 mm (7.5 %)", "15 mm (10 %)",
    ]  # fmt: skip


def test_a_smooth_ramp_begins_at_zero_and_its_loads_are_not_equally_spaced(
    shield: StudyResults,
) -> None:
    amplitude = 15.0
    ramp = 0.5 * amplitude * (1.0 + np.tanh(np.linspace(-6.0, 6.0, 9)))
    strained = abscissa.abscissa_of(shield.problem, shield.response)
    path = dataclasses.replace(strained, values=ramp)
    assert ramp[0] > 0.0
    assert path.at(0) == "0 mm (0 %)"
    assert path.at(-1) == "15 mm (10 %)"
    assert path.at(1) == "0.00185 mm (0.0012 %)"
    wave = dataclasses.replace(path, static=False, strain=None, unit="s")
    assert wave.at(0) == "9.22 × 10⁻⁵ s"
    drive = TanhRampDrive.model_construct(
        kind="tanh_ramp", units="right", amplitude=amplitude, directions=(np.pi,), duration=1.0
    )
    smooth = shield.problem.model_copy(update={"drive": drive})
    asked = dataclasses.replace(shield, problem=smooth)
    for study, note in (
        (shield, "equally spaced"),
        (asked, "equally spaced in time, not in displacement"),
    ):
        found = {fact.key: fact.note for fact in path_facts.scene_facts(study, path)}
        assert found["load_steps"] == note


def test_contacts_are_those_at_the_end_of_the_path(smile: StudyResults) -> None:
    pairs = smile.response["contact_pairs"]
    growing = pairs.copy(data=np.broadcast_to(np.arange(pairs.sizes["time"]), pairs.shape))
    found = checks.path_facts(
        smile.problem, smile.design, smile.response.assign(contact_pairs=growing)
    )
    ours = {fact.key: fact.value for fact in found}
    assert ours["contact_pairs_cloaked"] == pairs.sizes["time"] - 1


def test_copies_stand_in_a_table_and_failed_ones_are_counted(shield: StudyResults) -> None:
    copies = shield.scatter
    assert copies is not None
    second = spreads(copies["loss"], copies)[1]
    good = np.array([0.02, 0.03, 0.05, 0.06])
    assert (second.count, second.failed, second.clashing) == (4, 1, 2)
    assert second.middle == pytest.approx(np.median(good))
    assert second.high == pytest.approx(np.percentile(good, 95))
    assert "1 failed" in values(shield)["copies_geometry_5"].note
    table = robust_table(shield)
    assert table is not None
    assert table.rows[0][0] == "as designed"
    known = values(shield)
    assert table.rows[0][1][0][0] == known["rotation_cloaked"].ours
    assert table.rows[0][1][1][0] == known["loss_end"].ours
    worst = values(shield)["rotation_cloaked_copies"]
    assert worst.ours in {high for _, ((_, high), _) in table.rows[1:]}
    names = [name.partition(" with")[0].partition(" off")[0] for name, _ in table.rows[1:]]
    alike = "each stiffness of all ligaments alike"
    assert names == ["vertices", "stiffnesses", "vertices", alike, "vertices", "vertices"]
    assert worst.value > values(shield)["rotation_cloaked"].value


def test_the_headline_is_told_as_built_too(shield: StudyResults) -> None:
    response = shield.response.assign(displacement=1.5 * shield.response["displacement"])
    study = changed(shield, "built", response)
    known = values(shield)
    headline = [known[key] for key in ("rotation_cloaked", "rotation_cloaked_copies")]
    (fact,) = as_built_facts(study, kinds.LOADING_PATH, headline)
    assert (fact.key, fact.group) == ("built_rotation_cloaked", "As built")
    assert fact.value == pytest.approx(1.5 * known["rotation_cloaked"].value)
    assert as_built_facts(shield, kinds.LOADING_PATH, headline) == []
    table = robust_table(study)
    assert table is not None
    assert table.rows[1][0] == "as built"
    assert table.rows[1][1][0] == (fact.ours, fact_records.ABSENT)


def test_a_paper_is_quoted_by_the_keys_of_facts(shield: StudyResults, smile: StudyResults) -> None:
    assert values(shield)["rotation_reduction"].paper == "64 %"
    assert values(shield)["rotation_altered"].paper == fact_records.ABSENT
    assert {fact.paper for fact in values(smile).values()} == {fact_records.ABSENT}
    paper = Paper(figure="4", values={"rotation": "1"})
    with refused("no such fact", "report.paper.values.rotation"):
        fact_records.quoted(path_facts.loading_path_facts(shield), paper)


def test_facts_tell_of_load_steps(smile: StudyResults) -> None:
    found = values(smile)
    assert found["check_2_x_load_steps"].value == pytest.approx(0.05)
    assert found["check_10_x_load_steps"].note == "no equilibrium found"
    assert found["removed_units"].value == 18


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


def test_losses_under_either_law_of_contact(shield: StudyResults) -> None:
    dims = ("structure", "contact_law", "case")
    losses = np.array([[[0.92], [0.9]], [[0.05], [0.06]]])
    both = shield.response.assign_coords(contact_law=["angle", "geometric"]).assign(
        loss_by_contact=(dims, losses, {"units": "N mm"}),
        overlaps_by_contact=(dims, np.array([[[2.0], [0.0]], [[8.0], [0.0]]])),
        gap_by_contact=(dims, np.full((2, 2, 1), 0.02)),
    )
    found = values(changed(shield, "response", both))
    note = found["contact_geometric_cloaked"].note
    assert note.startswith("20.0 % against the angle law; none overlap")
    assert found["contact_angle_cloaked"].note.startswith("8 pairs of units overlap")


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


@pytest.mark.parametrize(
    ("law", "method", "descents", "told"),
    [
        ("angle", "sqp", 1, None),
        ("geometric", "mma", 1, None),
        ("geometric", "sqp", 1, "; SQP below starts from there"),
        ("geometric", "both", 2, ", in each descent; SQP below starts from there"),
    ],
)
def test_evaluations_by_angle(
    smile: StudyResults,
    law: Literal["angle", "geometric"],
    method: str,
    descents: int,
    told: str | None,
) -> None:
    budget = Method(evaluations=3)
    methods = Methods(**{name: budget for name in ("sqp", "mma") if method in (name, "both")})
    asked = smile.problem.with_optimiser(angle=budget, methods=methods, descents=descents)
    facts = checks.history_facts(law_comparison.under(asked, law), smile.design)
    notes = [fact.note for fact in facts if fact.key == "evaluations_angle"]
    assert len(notes) == (told is not None)
    if told is not None:
        assert f"by the angle law of contact{told}" in notes[0]
        assert notes[0].endswith("; MMA does without") == (method == "both")


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


def test_extremes_are_of_all_loads_or_at_any_time(study: StudyResults, smile: StudyResults) -> None:
    asked, of = smile.problem, (smile.design, smile.response)
    shaken = asked.model_copy(update={"drive": study.problem.drive})
    for posed, when in ((asked, "of all loads"), (shaken, "at any time")):
        notes = {fact.key: fact.note for fact in checks.path_facts(posed, *of)}
        assert notes["void_angle_cloaked"] == when
        assert notes["gap_cloaked"] == notes["overlaps_cloaked"] == f"{when}, by geometry"
