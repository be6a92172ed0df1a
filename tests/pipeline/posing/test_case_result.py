from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.posing import case_result, measure, scene_of, times_of
from pipeline.posing.case_result import PosedStructure, Times
from pipeline.problem import load
from sim.core import SimulationError
from sim.quasistatics import BRANCHING, StaticSolver
from sim.scene import cases_of, make_plan
from sim.solvers import Solved, solve_case
from tests.pipeline import static

SERIES = "{ kind: time_series, units: right, file: push.csv }"
SHAKEN = (
    "{ kind: harmonic, units: { units: [[2, 0]] }, amplitude: 1 mm, direction: 0 deg,"
    " frequency: 20 Hz }"
)


def output_times(folder: Path, drive: str, end: float) -> Times:
    """Poses a push that is known up to an end, s, which is the horizon's."""
    path = static.write(folder, static.HOLE, size=5)
    text = path.read_text()
    first, last = text.index("drive:"), text.index("constraints:")
    horizon = f"horizon: {{ duration: {end} s, samples: 12 }}"
    rest = text[last:].replace("samples: 9", "samples: 24")
    path.write_text(f"{text[:first]}{drive}\n{horizon}\n{rest}")
    rows = f"0,0,0,0\n{end},1,0,0\n"
    (folder / "push.csv").write_text(f"time (s),ux (mm),uy (mm),theta (rad)\n{rows}")
    asked = load(path)
    return times_of(asked, scene_of(asked, folder))


def test_a_response_goes_on_for_some_cycles_and_no_further_than_a_file(tmp_path: Path) -> None:
    steady = output_times(tmp_path, f"drive: {SHAKEN}", 0.1)
    np.testing.assert_allclose(steady.asked[-1], 0.2)
    both = output_times(tmp_path, f"drives:\n  - {SHAKEN}\n  - {SERIES}", 0.1)
    assert both.asked[-1] == both.asked[both.shown][-1] == 0.1


def test_no_time_is_beyond_the_end_of_a_file(tmp_path: Path) -> None:
    end = 0.06666666666666667  # rounded up to whole nanoseconds
    times = output_times(tmp_path, f"drive: {SERIES}", end)
    assert times.asked[-1] == end
    assert len(times.asked) == len(np.unique(times.asked))


def test_the_samples_of_a_short_motion_stay_apart(tmp_path: Path) -> None:
    end = 1e-7  # as of a specimen of a few micrometres, in which a nanosecond is long
    shaken = SHAKEN.replace("20 Hz", "20000000 Hz")
    times = output_times(tmp_path, f"drive: {shaken}", end)
    step = np.diff(times.asked[times.integrated])
    np.testing.assert_allclose(step, end / len(step), rtol=1e-5)
    assert len(np.unique(times.shown)) == len(times.shown)


def test_a_failure_on_the_other_branch_leaves_the_case(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    path = static.write(tmp_path, static.HOLE, size=5)
    asked = load(path)
    scene = scene_of(asked, tmp_path).updated(reference=None)
    times, vertices = times_of(asked, scene), scene.lattice.vertices
    plan = make_plan(scene, vertices, times.asked, every_case=True)
    (case,) = cases_of(scene, vertices, plan.solver)
    assert isinstance(case.solver, StaticSolver)
    found, rates, record = solve_case(case.solver, case.values, case.drive)
    branched = replace(record, jumped=np.full_like(record.jumped, BRANCHING))
    shape, sense = (-1, scene.lattice.n_units, 3), case.solver.sense

    def stuck(solver: StaticSolver, *of: Any) -> Any:  # noqa: ANN401  (as the real one)
        if solver.sense != sense:
            raise SimulationError("no equilibrium found")
        return solve_case(solver, *of)

    monkeypatch.setattr(case_result, "solve_case", stuck)
    solved = Solved(case, found.reshape(shape), rates.reshape(shape), branched)
    outcome = measure(PosedStructure(scene, vertices), times, None)(solved)
    assert np.isnan(outcome.loss_other_branch)
    assert outcome.loss > 0.0
    assert "the other branch of load case 0: no equilibrium found" in caplog.text
