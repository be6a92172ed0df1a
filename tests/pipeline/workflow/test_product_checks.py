from collections.abc import Mapping
from pathlib import Path

import pytest

from pipeline.problem import Problem, load
from pipeline.problem.sections import LoadRanges, Robust
from pipeline.workflow import product_checks
from pipeline.workflow.studies import Study
from tests.tables import refused

TOLERANT = {"robust": Robust(copies=2)}


def under(asked: Problem, **objective: object) -> Problem:
    """Sets keys of the objective."""
    return asked.model_copy(update={"objective": asked.objective.model_copy(update=objective)})


def compared(
    monkeypatch: pytest.MonkeyPatch, problems: Mapping[str, Problem], several: str = "several"
) -> list[str]:
    """Lists the presets on a page of gains, of a study whose own problem has no name."""
    found = {Study("mine", name): asked for name, asked in problems.items()}
    groups = {each: [each] if each.preset == several else [] for each in found}
    monkeypatch.setattr(product_checks, "problem_of", found.__getitem__)
    monkeypatch.setattr(product_checks, "families", lambda: groups)
    return [each.preset for each in product_checks.robust_presets("mine")]


def test_gains_compare_designs_that_fit_the_study(
    fig2: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = load(fig2)
    more = under(own, **TOLERANT)
    lattice = own.lattice.model_copy(update={"columns": 9})
    problems = {
        "": own,
        "tolerant": more,
        "several": more,
        "other": more.model_copy(update={"lattice": lattice}),
        "ranges": under(more, loads=LoadRanges()),
        "edge": own,
    }
    assert compared(monkeypatch, problems) == ["tolerant"]


@pytest.mark.parametrize("word", ["mine@several", "results/mine@several/report/index.html"])
def test_several_designs_have_a_page_of_harmonic_drives_alone(
    word: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was refused when all of them had been designed and simulated."""
    folder = Path(__file__).parents[3] / "experiments"
    study = Study("mine", "several")
    designs = [Study("mine", "several.1"), Study("mine", "several.2")]
    monkeypatch.setattr(product_checks, "targets", lambda: {str(study): str(study)})
    monkeypatch.setattr(product_checks, "families", lambda: {study: designs})
    for name, is_drawn in (("fig3", True), ("fig4", False)):
        asked = load(folder / name / "problem.yaml")
        monkeypatch.setattr(product_checks, "problem_of", lambda _, asked=asked: asked)
        if is_drawn:
            product_checks.check_products([word])
            continue
        with refused("page of several designs", "drive.kind", "build mine@several.1, mine@") as one:
            product_checks.check_products([word])
        assert one.value.file == "experiments/mine/problem.yaml"
        assert one.value.value == "linear_ramp"


def test_gains_of_a_robust_study_are_over_what_it_asks_itself(
    fig2: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = under(load(fig2), **TOLERANT)
    problems = {"": own, "quick": own, "worst": under(own, robust=Robust(copies=4))}
    assert compared(monkeypatch, problems) == ["worst"]
