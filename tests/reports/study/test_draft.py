from pathlib import Path

import pytest
import yaml

from pipeline import problem
from pipeline.problem import Problem
from pipeline.problem.sections import Method, Methods
from pipeline.runtime import ROOT
from reports.study import draft
from tests.pipeline import static


def driven(folder: Path, **drive: str) -> Problem:
    """Writes a small compressed lattice with a drive of its right column."""
    path = static.write(folder, static.HOLE, size=5)
    asked = yaml.safe_load(path.read_text())
    asked["drive"] = {"units": "right", **drive}
    path.write_text(yaml.safe_dump(asked))
    return problem.load(path)


def torque(folder: Path, amplitude: float) -> Problem:
    return driven(folder, kind="torque", amplitude=f"{amplitude} N mm")


@pytest.mark.parametrize(
    ("ours", "reason"),
    [
        (-300.0, []),
        (-200.0, []),
        (-100.0, ["100 N mm of driven load instead of 200"]),
    ],
)
def test_loads_are_compared_by_their_size(tmp_path: Path, ours: float, reason: list[str]) -> None:
    assert draft.reasons(torque(tmp_path, ours), torque(tmp_path, -200.0)) == reason


@pytest.mark.parametrize(
    ("frequency", "reason"), [(None, []), (4.0, ["accuracy of the solver: draft"])]
)
def test_a_draft_is_one_of_motions_in_time(
    tmp_path: Path, frequency: float | None, reason: list[str]
) -> None:
    asked = torque(tmp_path, 200.0)
    drive = asked.drive.model_copy(update={"frequency": frequency})
    study = asked.model_copy(update={"drive": drive})
    solver = study.solver.model_copy(update={"accuracy": "draft"})
    assert draft.reasons(study.model_copy(update={"solver": solver}), study) == reason


def test_a_force_is_no_less_than_a_displacement(tmp_path: Path) -> None:
    push = driven(tmp_path, kind="force", amplitude="5 N", direction="180 deg")
    ramp = {"kind": "linear_ramp", "duration": "1 s", "direction": "180 deg"}
    shift = driven(tmp_path, amplitude="15 mm", **ramp)
    assert draft.reasons(push, shift) == []
    assert draft.reasons(shift, push) == []


@pytest.mark.parametrize(
    ("methods", "start", "reason"),
    [
        ({"sqp": 4, "mma": 3}, "initial", ["3 evaluations by MMA instead of 9"]),
        ({"mma": 9}, "initial", []),
        ({"sqp": 3}, "initial", ["3 evaluations by SQP instead of 4"]),
        ({"sqp": 3}, "study", []),
    ],
)
def test_evaluations_are_compared_by_method_and_from_the_same_start(
    tmp_path: Path, methods: dict[str, int], start: str, reason: list[str]
) -> None:
    study = torque(tmp_path, 100.0)
    budgets = Methods(sqp=Method(evaluations=4), mma=Method(evaluations=9))
    mine = Methods(**{name: Method(evaluations=count) for name, count in methods.items()})
    asked = study.with_optimiser(methods=mine, start=start)
    assert draft.reasons(asked, study.with_optimiser(methods=budgets)) == reason


def test_what_a_preset_leaves_out_is_not_less() -> None:
    study = problem.load(ROOT / "experiments/fig2/problem.yaml")
    less = study.model_copy(update={"sweep": None, "robustness": None})
    assert study.sweep is not None
    assert draft.reasons(less, study) == []
    (few, *_) = draft.reasons(problem.load(ROOT / "experiments/fig2/problem.yaml", "quick"), study)
    assert "instead of" in few
