from dataclasses import replace

import pytest
import yaml
from pydantic import ValidationError

from pipeline.runtime import ROOT, UserError
from pipeline.workflow import studies
from reports.facts import Fact, claims, number
from reports.figures.loading_path import facts as along
from reports.figures.shielding import facts as shielding
from reports.study import StudyResults
from tests.tables import cases

UNIT = {"1", "mm", "ms", "deg", "%", "Hz", "spacings"}


def test_claims_are_in_words_of_their_own_with_a_line_and_a_unit() -> None:
    listed = claims.listed().claims
    assert {claim.study for claim in listed} == {f"fig{n}" for n in range(2, 8)}
    assert len({(claim.study, claim.fact, claim.relation) for claim in listed}) == len(listed)
    for claim in listed:
        value, unit, place = claims.parsed(claim.paper or claim.meaning or "")
        assert value >= 0
        assert unit in UNIT
        assert place <= 1


def test_our_own_claims_are_on_targets_and_facts_that_there_are() -> None:
    known = yaml.safe_load((ROOT / "reports/products/certificate/facts.yaml").read_text())
    for claim in claims.own().claims:
        assert claim.study in studies.targets()
        assert claim.fact in known
        assert claims.parsed(claim.number)[0] > 0
    open_ones = claims.assessed("fig2@unbiased", [])
    assert {each.simulation.status for each in open_ones} == {"not yet evaluated"}
    assert not claims.quoted(open_ones)
    assert claims.quoted(claims.assessed("fig2", []))


def test_a_claim_is_the_papers_with_its_line_or_our_own() -> None:
    words = {"study": "fig2", "relation": "is", "fact": "units", "of": "setting", "says": "units"}
    for given in ({"paper": "15 mm"}, {"ours": "15 mm", "line": 3}, {"ours": "1", "paper": "1"}):
        with pytest.raises(ValidationError):
            claims.Claim.model_validate(words | given)


@pytest.mark.parametrize("name", ["fig2", "fig4", "fig5"])
def test_every_claim_on_a_study_that_can_be_built_has_its_fact(
    name: str, study: StudyResults, shield: StudyResults, smile: StudyResults
) -> None:
    known = {
        "fig2": lambda: shielding.shielding_facts(study),
        "fig4": lambda: along.loading_path_facts(shield),
        "fig5": lambda: along.loading_path_facts(smile),
    }[name]()
    for judged in claims.assessed(name, known):
        assert judged.simulation.status in {"holds", "does not hold"}, judged.claim.fact


@cases("reports", "text, number")
def test_numbers_are_read_with_their_last_place(text: str, number: list[object]) -> None:
    assert list(claims.parsed(text)) == pytest.approx(number)


@cases("reports", "ours, relation, holds")
def test_a_relation_has_its_tolerance(ours: float, relation: claims.Relation, holds: bool) -> None:
    assert claims.agrees(ours, relation, 5.2, 0.1) is holds


def found(*facts: Fact) -> dict[str, claims.AssessedClaim]:
    return {each.claim.fact: each for each in claims.assessed("fig4", facts)}


ROTATION = number("rotation_altered", "mean", 10.5, "deg")


def test_both_holds_only_where_both_hold_and_what_is_missing_is_told() -> None:
    assert found()["rotation_altered"].simulation.why == "study not built"
    assert found(ROTATION)["rotation_reduction"].simulation.why == "no result"
    alone = found(ROTATION)["rotation_altered"]
    assert alone.experiment.why == "no recording compared"
    assert (alone.simulation.status, alone.experiment.status) == ("holds", "not yet evaluated")
    assert alone.both == "not yet evaluated"
    measured = replace(ROTATION, key="measured_rotation_altered", value=11.5)
    assert found(ROTATION, measured)["rotation_altered"].both == "holds"
    off = replace(measured, value=15.0)
    assert found(ROTATION, off)["rotation_altered"].both == "does not hold"


def test_multiples_of_the_spacing_are_lengths_other_units_refused() -> None:
    radius = number("interest_radius", "radius", 52.0, "mm")
    spacing = number("spacing", "spacing", 15.0, "mm")
    assert found(radius, spacing)["interest_radius"].simulation.status == "holds"
    assert found(radius, spacing)["interest_radius"].simulation.ours == "52 mm = 3.47 spacings"
    for value in (37.5, 52.5, 67.5):
        off = replace(radius, value=value)
        assert found(off, spacing)["interest_radius"].simulation.status == "does not hold"
    with pytest.raises(UserError, match="rotation_altered"):
        found(replace(ROTATION, unit="rad"))


def test_the_verdict_counts_and_bears_the_label() -> None:
    judged = claims.assessed("fig4", [ROTATION])
    assert "in experiment (SYNTHETIC), 0 of 3" in claims.verdict(judged, "SYNTHETIC")
    words = claims.verdict(judged)
    assert words == (
        "Claims that hold: 1 of 9 (8 not yet evaluated) in simulation, 0 of 3 (3 not yet "
        "evaluated) in experiment, 0 of 3 (3 not yet evaluated) in both."
    )
