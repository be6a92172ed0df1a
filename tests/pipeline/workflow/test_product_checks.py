from collections.abc import Mapping
from pathlib import Path

import pytest

from pipeline.problem import Problem, load
from pipeline.problem.sections import LoadRanges, Robust
from pipeline.workflow import product_checks
from pipeline.workflow.studies import Study

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


def test_gains_of_a_robust_study_are_over_what_it_asks_itself(
    fig2: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = under(load(fig2), **TOLERANT)
    problems = {"": own, "quick": own, "worst": under(own, robust=Robust(copies=4))}
    assert compared(monkeypatch, problems) == ["worst"]
