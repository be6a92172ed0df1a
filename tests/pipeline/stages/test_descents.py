import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from pipeline import datasets
from pipeline.problem import Problem
from pipeline.problem.reading import load
from pipeline.problem.sections import Method, Methods
from pipeline.stages import design
from reports.facts.checks import history_facts
from sim.core import SimulationError
from sim.optimise import InfeasibleStartError, Result, SqpOptions
from sim.scene import minimise
from tests.pipeline import static
from tests.pipeline.conftest import Failing
from tests.pipeline.static import HOLE, write


def posed(folder: Path, angle: str, descents: int = 1, seed: int = 0) -> Path:
    """Writes a problem of six evaluations of contact on distance."""
    folder.mkdir()
    path = write(folder, HOLE, size=5, amplitude=3.0)
    more = f"angle: {angle}, descents: {descents}, seed: {seed}, geometric:"
    text = path.read_text().replace("law: angle", "law: geometric")
    text = text.replace("geometric: {", more + " {")
    path.write_text(text.replace("sqp: { evaluations: 4 }", "sqp: { evaluations: 6 }"))
    return path


def designed(folder: Path, angle: str, descents: int = 1, seed: int = 0) -> xr.Dataset:
    """The design by SQP."""
    return datasets.read(static.designed(posed(folder, angle, descents, seed)), "design")


def test_a_design_by_the_angle_law_is_where_it_starts(hole: list[str], tmp_path: Path) -> None:
    by_angle = datasets.read(Path(hole[1]).with_name("design.nc"), "design")
    after = designed(tmp_path / "a", "{ evaluations: 4 }")
    first, second = (each["design_vector"].values[0] for each in (by_angle, after))
    np.testing.assert_array_equal(second[0], first[int(by_angle["best_evaluation"][0])])
    initial = designed(tmp_path / "b", "null")
    assert not initial["design_vector"].values[0, 0].any()


def test_the_best_of_descents_is_shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    optimise, budgets = design.optimise, {4: 2, 5: 6, 6: 4}

    def limited(asked: Problem, *more: Any) -> Result:  # noqa: ANN401
        """As many evaluations as the seed is given."""
        method = Method(evaluations=budgets[asked.optimiser.seed])
        return optimise(asked.with_optimiser(methods=Methods(sqp=method)), *more)

    monkeypatch.setattr(design, "optimise", limited)
    shipped = designed(tmp_path / "all", "null", descents=3, seed=4)
    first, second, third = json.loads(shipped.attrs["plan"])["descents"]
    assert second < third < first
    assert float(shipped["best_loss"][0]) == second
    assert shipped.sizes["evaluation"] == 6
    alone = designed(tmp_path / "alone", "null", seed=5)
    kicked, initial = (each["design_vector"].values[0, 0] for each in (shipped, alone))
    assert not initial.any()
    assert np.abs(kicked).max() > 0.0


def stopping(monkeypatch: pytest.MonkeyPatch, failures: dict[int, Exception]) -> None:
    """Makes descents fail that have some of the seeds."""

    def stopped(*given: Any, options: SqpOptions, **more: Any) -> Result:  # noqa: ANN401
        if options.seed in failures:
            raise failures[options.seed]
        return minimise(*given, options=options, **more)

    monkeypatch.setattr(design, "minimise", stopped)


@pytest.mark.parametrize("failure", [SimulationError("a snap"), InfeasibleStartError(0, 0.3)])
def test_a_descent_that_fails_leaves_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: Exception
) -> None:
    stopping(monkeypatch, {5: failure})
    shipped = designed(tmp_path / "all", "null", descents=3, seed=4)
    first, second, third = json.loads(shipped.attrs["plan"])["descents"]
    assert second is None
    assert float(shipped["best_loss"][0]) == min(first, third)
    problem = load(tmp_path / "all/problem.yaml")
    facts = {each.key: each for each in history_facts(problem, shipped)}
    assert facts["descents"].ours.endswith("; 1 without a design")


def test_where_all_descents_fail_the_first_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: Failing
) -> None:
    stopping(monkeypatch, {4: SimulationError("no way"), 5: SimulationError("nor here")})
    path = posed(tmp_path / "all", "null", descents=2, seed=4)
    words = ["--problem", str(path), "--method", "sqp", "--out", str(tmp_path / "x.nc")]
    told = failing("design", words)
    assert "error: the initial structure cannot be simulated: no way" in told
    second = "descent 2 of 2 ends without a design: the starting structure cannot be simulated"
    assert second in told
