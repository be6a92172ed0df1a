import dataclasses
from typing import Literal

import numpy as np
import pytest

from pipeline.posing import law_comparison
from pipeline.problem.sections import Method, Methods, Paper, TanhRampDrive
from reports.facts import checks, fact_records, loss_formula
from reports.facts.copies import spreads
from reports.figures import kinds
from reports.figures.loading_path import (
    abscissa,
    tables,
)
from reports.figures.loading_path import facts as path_facts
from reports.figures.robust_table import robust_table
from reports.figures.study_report import as_built_facts
from reports.study import StudyResults
from tests.reports.loading_paths import changed, values
from tests.tables import refused


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


def test_extremes_are_of_all_loads_or_at_any_time(study: StudyResults, smile: StudyResults) -> None:
    asked, of = smile.problem, (smile.design, smile.response)
    shaken = asked.model_copy(update={"drive": study.problem.drive})
    for posed, when in ((asked, "of all loads"), (shaken, "at any time")):
        notes = {fact.key: fact.note for fact in checks.path_facts(posed, *of)}
        assert notes["void_angle_cloaked"] == when
        assert notes["gap_cloaked"] == notes["overlaps_cloaked"] == f"{when}, by geometry"
