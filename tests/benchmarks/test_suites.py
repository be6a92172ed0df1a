"""Skips change nothing beyond their tolerance; optimisers, cases and scenes are what they say."""

import re
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks import suites
from benchmarks.harness import errors
from benchmarks.methods import jax_baseline
from benchmarks.picture import PAGE, TableRow, figure, tables
from benchmarks.scenes import paper_scenes
from reports.base import style
from sim.core import Floats
from sim.energy import gradient, kinematics_of, system_of
from sim.scene import concrete_parameters, parameters_of_design
from sim.solvers import Harmonic
from tests.tables import some

COMPILED = ("compilation", "fresh factors")
"""Those that compile every loop anew, seconds each: tests/slow/test_benchmarks.py tries them."""


@pytest.mark.parametrize(
    "skip",
    some([skip for skip in suites.SKIPS if skip.name not in COMPILED]),
    ids=lambda skip: skip.name,
)
def test_a_skip_changes_nothing_beyond_its_tolerance(skip: suites.Skip) -> None:
    name = "small_wave" if skip.wave else "small_push"
    done, skipped = (skip.prepare(name, made, "loss")().values for made in (0.0, 1.0))
    refuse_change(skip, done, skipped)


def refuse_change(
    skip: suites.Skip, done: Mapping[str, Floats], skipped: Mapping[str, Floats]
) -> None:
    changes = errors(done, skipped)
    assert changes.keys() == done.keys() == skipped.keys()
    assert np.max([*changes.values()]) <= skip.tolerance


@pytest.mark.parametrize("optimiser", some(suites.OPTIMISERS))
def test_an_optimiser_lowers_the_loss(optimiser: str) -> None:
    course = suites.prepare(
        "small_push", suites.OptimiserBudget(evaluations=30), optimiser
    )().values
    best = course["best"][np.isfinite(course["best"])]
    assert len(course["loss"]) <= 30
    assert np.all(np.diff(best) <= 0.0)
    assert course["final"] == pytest.approx(best[-1], rel=1e-6)
    assert course["final"] < 0.9 * course["loss"][0]
    feasible = course["loss"][course["violation"] <= suites.FEASIBLE]
    assert feasible.min() == best[-1]


def test_a_design_with_a_clearance_that_is_no_number_is_not_the_best() -> None:
    asked: Any = SimpleNamespace(
        losses=[1.0],
        designs=[np.zeros(2)],
        clock=[0.0],
        n_variables=2,
        constraints=lambda _: (np.array([np.nan, 1.0]), np.eye(2)),
    )
    course = suites.optimiser_contest.judge(asked, lambda _: (1.0, np.ones(2), np.zeros(2)))
    assert np.isnan([*course.violation, *course.best]).all()


def test_a_case_does_not_depend_on_those_after_it() -> None:
    alone, three = (suites.sweep_growth.cases("quick", count)() for count in (1, 3))
    assert (alone.work, three.work) == ({"cases": 1}, {"cases": 3})
    assert np.isfinite(alone.values["loss"]).all()
    np.testing.assert_array_equal(alone.values["loss"], three.values["loss"])


def test_counts_of_variables_and_the_direction_of_one_case() -> None:
    assert paper_scenes.fig2().space.n_variables == 304
    assert paper_scenes.fig2(symmetry="C4").space.n_variables == 76
    assert paper_scenes.fig4().space.n_variables == 280
    (motion,) = paper_scenes.one_case(paper_scenes.fig2(), 135.0).loads.motions
    assert isinstance(motion, Harmonic)
    assert float(motion.direction) == pytest.approx(np.deg2rad(135.0))


@pytest.mark.slow
def test_the_baseline_has_the_same_forces() -> None:
    scene = paper_scenes.fig2()
    values = concrete_parameters(scene, scene.lattice.vertices)
    motion = 0.05 * np.random.default_rng(0).normal(size=scene.topology.n_dofs)
    ours = np.empty_like(motion)
    system = system_of(scene.topology, values)
    gradient(motion, system, kinematics_of(system), ours)
    made = parameters_of_design(scene)(jnp.zeros(scene.space.n_variables))
    theirs = jax_baseline.force(scene)(made, jnp.asarray(motion.reshape(-1, 3)))
    np.testing.assert_allclose(np.ravel(theirs), ours, atol=1e-12 * np.abs(ours).max())


def test_the_growth_in_words_is_that_of_the_table() -> None:
    page = " ".join(PAGE.read_text(encoding="utf-8").split())
    found = re.search(r"exponent of time by units, 30 to 120: ([\d.]+)", page)
    told = re.search(r"to the power of ([\d.]+) between.*? rises from (\d+) to (\d+);", page)
    counts = [re.search(rf" {n} x {n} [^x]*?(\d+) factorisations", page) for n in (30, 120)]
    assert found
    assert told
    assert list(told.groups()) == [found[1], *(count[1] for count in counts if count)]


def test_the_picture_shows_the_tables_whole() -> None:
    found = tables(PAGE.read_text(encoding="utf-8"))
    wanted = {"fig2": 4, "fig4": 3, "precision": 7, "warm": 2, "static": 6}
    assert {name: len(rows) for name, rows in found.items()} == wanted
    assert found["fig2"][0] == TableRow("ours", 0.335, 3.1e-05)
    with style.styled():
        left, right = figure(found).axes
    ends = [bar.get_path().get_extents(bar.get_transform()) for bar in left.patches]
    times = left.transData.inverted().transform([[end.x1, end.y1] for end in ends])[:, 0]
    beside = [*reversed(found["fig4"][:2]), *reversed(found["fig2"][:3])]
    np.testing.assert_allclose(times, [row.time for row in beside])
    shown = np.concatenate([np.asarray(line.get_xydata()) for line in right.lines])
    assert set(map(tuple, shown)) == {(row.time, row.error) for row in found["precision"]}
