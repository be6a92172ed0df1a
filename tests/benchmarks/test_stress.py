"""The stress suite: its verdicts, its checks on spoilt answers, and itself in small."""

import json
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.stress import (
    LAWS,
    Check,
    RandomDesigns,
    StressCase,
    StressFamily,
    StressScene,
    Tally,
    balance,
    checks,
    pressed,
    run_attempt,
    shaken,
    squares,
    stiffness,
)
from benchmarks.stress import __main__ as suite
from benchmarks.stress.families import constants, pieces
from sim.core import SimulationError
from sim.quasistatics import StaticSolver
from sim.solvers import Harmonic
from sim.time_integration import ImplicitRecord, ImplicitSolver

IN_SMALL = ("branches", "symmetry", "agreement")
"""Families that are tried in small here, the quickest; make stress tries all."""


def found(value: float) -> list[Check]:
    return [Check("error", value, 1.0)]


def refused(message: str) -> list[Check]:
    raise SimulationError(message)


@pytest.mark.parametrize(
    ("attempt", "expected", "verdict"),
    [
        (lambda: found(1.0), "solution", "solved"),
        (lambda: found(1.1), "solution", "wrong"),
        (lambda: found(np.nan), "solution", "wrong"),
        (lambda: refused("it jams; try a smaller load"), "solution", "refused"),
        (lambda: refused("it jams"), "solution", "wrong"),
        (lambda: [Check("none", 1 / 0, 1.0)], "solution", "wrong"),
        (lambda: found(0.0), "refusal", "wrong"),
        (lambda: refused("there is none; try another"), "refusal", "refused"),
    ],
)
def test_verdicts(attempt: Callable[[], list[Check]], expected: Any, verdict: str) -> None:  # noqa: ANN401
    assert run_attempt(StressCase("toy", attempt, expected)).verdict == verdict


def test_only_what_a_study_may_ask_for_counts_as_in_range() -> None:
    family = StressFamily("toy", "", "", lambda _: ())
    cases = [
        StressCase("good", lambda: found(0.5)),
        StressCase("better", lambda: found(0.1)),
        StressCase("refused", lambda: refused("no; try another")),
        StressCase("rightly", lambda: refused("no; try another"), "refusal"),
        StressCase("either", lambda: refused("no; try another"), "either"),
    ]
    tally = Tally(family, tuple(run_attempt(case) for case in cases))
    assert tally.in_range == (3, 2)
    assert tally.counts == {"solved": 2, "refused": 3}
    assert tally.worst == found(0.5)
    beyond = [[Check("beyond, deg", value, 0.0)] for value in (-2.0, -0.5, -1.0)]
    cases = [StressCase("toy", lambda made=made: made) for made in beyond]  # type: ignore[misc]
    assert Tally(family, tuple(map(run_attempt, cases))).worst == beyond[1]


def values_of(made: list[Check]) -> dict[str, Check]:
    return {check.name: check for check in made}


@pytest.fixture(scope="module", params=list(LAWS.values()), ids=list(LAWS))
def plate(request: pytest.FixtureRequest) -> StressScene:
    return pressed(squares(3), 0.15, contact=request.param)


@pytest.mark.slow
def test_the_definition_has_the_derivatives_of_its_energy(plate: StressScene) -> None:
    state = checks.solved(plate, StaticSolver(plate.topology, np.ones(1))).displacement[-1]
    direction = np.random.default_rng(0).normal(size=len(state)) * 1e-5
    ahead, behind = (balance(plate.structure, state + sign * direction) for sign in (1, -1))
    work = (ahead.energy - behind.energy) / 2
    here = balance(plate.structure, state)
    assert -here.force @ direction == pytest.approx(work, rel=1e-5)
    change = (behind.force - ahead.force) / 2
    assert stiffness(plate.structure, state) @ direction == pytest.approx(
        change, rel=1e-4, abs=1e-4 * np.abs(change).max()
    )


def test_equilibria_off_balance_and_units_in_one_another_are_found(plate: StressScene) -> None:
    answer = checks.solved(plate, StaticSolver(plate.topology, np.ones(1)))
    assert all(check.within_limit for check in checks.check_balance(plate, answer))
    assert all(check.within_limit for check in checks.check_admissible(plate, answer.displacement))
    free = plate.topology.free_dofs
    moved = answer.displacement.copy()
    moved[0, free[0]] += 1e-4
    away = values_of(checks.check_balance(plate, answer._replace(displacement=moved)))
    assert not away["distance from balance, mm/mm"].within_limit
    middle = 3 * 4 + 2
    within = []
    for turn in (2.0, -2.0):  # one of which closes the narrower voids around the unit
        turned = answer.displacement.copy()
        turned[0, middle] += turn
        within += [check.within_limit for check in checks.check_admissible(plate, turned)]
    assert not all(within)
    moved[0, middle] = np.nan
    assert not all(check.within_limit for check in checks.check_admissible(plate, moved))


def test_saddles_and_stages_off_balance_are_found() -> None:
    """A straight chain, pressed, stays in balance beyond the load at which it buckles."""
    chain = pressed(squares(9, 1, bias=0.0), 0.04)
    straight = np.zeros((1, chain.topology.n_dofs))
    straight[0, ::3] = -0.04 * 9 * 15.0 * np.arange(9) / 8
    answer = checks.solved(chain, StaticSolver(chain.topology, np.ones(1)))
    made = values_of(checks.check_balance(chain, answer._replace(displacement=straight)))
    assert made["distance from balance, mm/mm"].within_limit
    assert not made["falling directions of an equilibrium"].within_limit
    case = shaken(squares(3), Harmonic(1.0, 30.0), duration=0.01, frequency=30.0)
    times = np.linspace(0.0, 0.01, 11)
    solver = ImplicitSolver(case.topology, times, times)
    record = checks.solved(case, solver).record
    assert isinstance(record, ImplicitRecord)
    assert all(check.within_limit for check in checks.stages(case, solver, record))
    for spoilt in (1.1 * record.a[3], np.nan):
        record.a[3] = spoilt
        assert not all(check.within_limit for check in checks.stages(case, solver, record))


def test_a_distance_that_is_no_number_is_not_kept(
    plate: StressScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer = checks.solved(plate, StaticSolver(plate.topology, np.ones(1)))
    lost = balance(plate.structure, answer.displacement[0])._replace(force=np.full(27, np.nan))
    monkeypatch.setattr(checks, "balance", lambda *_: lost)
    assert not values_of(checks.check_balance(plate, answer))[
        "distance from balance, mm/mm"
    ].within_limit


def test_drawn_designs_can_be_made_and_reach_their_bounds() -> None:
    lattice = squares(4)
    draws = RandomDesigns(lattice, np.array([5]), 7.0, 0.97)
    vertices = draws(3)
    assert 0.0 <= draws.at_bounds(vertices) < 0.3
    assert np.abs(vertices - lattice.vertices).max() > 1.0
    np.testing.assert_array_equal(vertices, draws(3))


@pytest.mark.slow
def test_the_suite_in_small_finds_nothing_wrong(tmp_path: Path) -> None:
    path = tmp_path / "stress.json"
    assert suite.main(["--small", *IN_SMALL, "--out", str(path)]) == 0
    families = json.loads(path.read_text(encoding="utf-8"))["families"]
    assert [each["name"] for each in families] == list(IN_SMALL)
    assert sum(each["wrong"] for each in families) == 0


def test_a_wrong_answer_fails_the_suite(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    family = StressFamily("toy", "", "", lambda _: [StressCase("bad", lambda: found(2.0))])
    monkeypatch.setattr(suite, "FAMILIES", {"toy": family})
    assert suite.main(["--out", str(tmp_path / "stress.json")]) == 1
    assert "wrong: toy: bad: error: 2, limit 1" in capsys.readouterr().out
    assert suite.main(["tides"]) == 2
    assert "no family tides" in capsys.readouterr().err


def test_as_many_random_scenes_are_tried_as_are_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    drawn = StressFamily(
        "toy",
        "",
        "",
        lambda _: (StressCase(f"draw {seed}", lambda: found(0.5)) for seed in count()),
        endless=True,
    )
    monkeypatch.setattr(suite, "FAMILIES", {"toy": drawn})
    out = tmp_path / "stress.json"
    assert suite.main(["--tries", "3", "--first", "7", "--out", str(out)]) == 0
    assert "toy: 3 cases" in capsys.readouterr().err
    assert json.loads(out.read_text(encoding="utf-8"))["families"][0]["solved"] == 3


def test_units_without_a_ligament_are_refused_by_every_solver() -> None:
    alone = [case for case in pieces.cases(False) if "no ligament" in case.name]
    assert len(alone) == 3
    for case in alone:
        outcome = run_attempt(case)
        assert outcome.verdict == "refused"
        assert "no two units are joined" in outcome.message


def test_stages_settle_that_contract_fast_at_first_and_slowly_then() -> None:
    name = "axial stiffness times 1e+01, shaken at 60 Hz"
    stiff = [case for case in constants.cases(False) if case.name == name]
    assert [run_attempt(case).verdict for case in stiff] == ["solved"]


def test_counts_of_a_part_do_not_replace_those_of_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    toy = StressFamily("toy", "", "", lambda _: [StressCase("good", lambda: found(0.5))])
    counts, aside = tmp_path / "stress.json", tmp_path / "part.json"
    monkeypatch.setattr(suite, "FAMILIES", {"toy": toy})
    monkeypatch.setattr(suite, "COUNTS", counts)
    for part in (["toy"], ["--small"], ["--only", "good"], ["--tries", "3"]):
        assert suite.main(part) == 0
        assert not counts.exists()
        assert "a part of the suite" in capsys.readouterr().err
    assert suite.main(["toy", "--out", str(aside)]) == 0
    assert suite.main([]) == 0
    assert aside.read_text() == counts.read_text()
