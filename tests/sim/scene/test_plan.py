import json
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import sim
from benchmarks.scenes import CUTOFF, MATERIAL
from sim.core import Floats
from sim.energy import topology
from sim.quasistatics import StaticSolver
from sim.solvers import differentiable_motion, solve_case
from sim.time_integration import ExplicitSolver, ImplicitSolver
from tests.sim.structures import central
from tests.tables import cases

ANGLES = np.deg2rad([0.0, 45.0, 90.0, 135.0])
NEGLIGIBLE = 1e-12


SHAKEN_ALONG_ONE = (sim.Harmonic(3.0, 5.0, 0.6),)
PUSHED: dict[str, Any] = {
    "motions": (sim.LinearRamp(3.0, 1.0, 0.6),), "duration": 1.0, "static": True,
    "frequency": None, "samples": 5,
}  # fmt: skip
SHAKEN = tuple(sim.Harmonic(3.0, 5.0, angle) for angle in ANGLES)


def scene(motions: tuple[sim.MotionLaw, ...] = SHAKEN, **changes: Any) -> sim.Scene:  # noqa: ANN401
    """7 x 7 squares, corners clamped, the middle driven; the ring next to it may change."""
    lattice = sim.quads(7, 7, 15.0, 2.25, np.deg2rad(20.0))
    distance = np.abs(lattice.index - 3).max(axis=1)
    made = sim.Scene(
        sim.Structure(lattice, MATERIAL),
        sim.Loads(
            tuple(sim.PrescribedMotion(np.array([24]), motion) for motion in motions),
            (sim.Clamp(np.array([0, 6, 42, 48])),),
            duration=0.2,
        ),
        sim.Objective(region=np.flatnonzero(distance == 3), samples=41),
        sim.Design(cloak=np.flatnonzero(distance == 1)),
    )
    return made.updated(**changes)


def design_of(scene: sim.Scene, size: float = 0.4) -> Floats:
    return size * np.random.default_rng(4).uniform(-1, 1, scene.space.n_variables)


def relative(one: Floats, other: Floats) -> float:
    return float(np.abs(one - other).max() / np.abs(other).max())


def test_skipped_contact_changes_nothing() -> None:
    posed = scene()
    values = sim.concrete_parameters(posed, np.asarray(posed.space.vertices(design_of(posed))))
    solver = sim.make_plan(posed).solver
    assert isinstance(solver, ImplicitSolver)
    assert len(solver.touching(values)) < posed.lattice.n_ligaments
    complete = replace(solver, turn_allowance=np.inf)
    for drive in posed.loads.cases:
        skipping, full = (solve_case(s, values, drive)[0] for s in (solver, complete))
        assert relative(skipping, full) < NEGLIGIBLE


def test_a_void_that_closes_after_all_is_not_skipped() -> None:
    """Allowed hardly any rotation, ligaments come to the cutoff that had been left out."""
    posed = scene(
        lattice=sim.quads(7, 7, 15.0, 2.25, np.deg2rad(46.0)),
        motions=(sim.Harmonic(4.0, 5.0, 0.3),),
        integrator="implicit",
    )
    values = sim.concrete_parameters(posed, posed.lattice.vertices)
    solver = sim.make_plan(posed).solver
    assert isinstance(solver, ImplicitSolver)
    careless = replace(solver, turn_allowance=0.01)
    assert len(careless.touching(values)) < posed.lattice.n_ligaments
    motion = solve_case(careless, values, posed.loads.cases[0])[0]
    complete = solve_case(replace(solver, turn_allowance=np.inf), values, posed.loads.cases[0])[0]
    states = complete.reshape(len(complete), -1, 3)
    assert posed.topology.smallest_void_angle(values.void, states).min() < CUTOFF
    assert relative(motion, complete) < NEGLIGIBLE


def test_turned_copies_of_a_case_have_its_loss_and_gradient() -> None:
    posed = scene(symmetry="C4")
    plan = sim.make_plan(posed)
    np.testing.assert_array_equal(plan.case_of, [0, 1, 0, 1])
    every = replace(plan, case_of=np.arange(4))
    design = design_of(posed)
    loss, gradient, each = sim.Evaluator(posed, plan)(design)
    all_loss, all_gradient, all_each = sim.Evaluator(posed, every)(design)
    assert loss == pytest.approx(all_loss, rel=NEGLIGIBLE)
    assert relative(each, all_each) < NEGLIGIBLE
    assert relative(gradient, all_gradient) < NEGLIGIBLE


@pytest.mark.parametrize(
    "changes",
    [
        {"motions": (*SHAKEN[:2], *(sim.Harmonic(3.0, 6.0, angle) for angle in ANGLES[2:]))},
        {"symmetry": "none"},
    ],
    ids=["frequencies", "design"],
)
def test_cases_are_no_copies_without_the_whole_symmetry(changes: dict[str, Any]) -> None:
    plan = sim.make_plan(scene(**{"symmetry": "C4", **changes}))
    np.testing.assert_array_equal(plan.case_of, np.arange(4))


def test_a_given_structure_is_judged_by_its_own_symmetry() -> None:
    posed = scene()
    symmetric = sim.make_plan(posed, vertices=posed.lattice.vertices)
    np.testing.assert_array_equal(symmetric.simulated, [0, 1])
    uneven = np.asarray(posed.space.vertices(design_of(posed)))
    np.testing.assert_array_equal(sim.make_plan(posed, vertices=uneven).simulated, np.arange(4))


@pytest.mark.parametrize(
    "changes",
    [
        {"duration": 0.05, "integrator": "implicit"},
        {"duration": 0.05, "integrator": "explicit"},
        PUSHED | {"kind": "strain_energy"},
    ],
    ids=["implicit", "explicit", "static"],
)
def test_skipped_derivatives_change_nothing(changes: dict[str, Any]) -> None:
    posed = scene(**{"motions": SHAKEN_ALONG_ONE, "weights": np.ones(1), **changes})
    plan = sim.make_plan(posed)
    assert len(posed.topology.designed) < posed.lattice.n_ligaments
    complete = topology(posed.lattice, posed.loads.held, posed.structure.contact)
    solver = plan.solver
    assert isinstance(solver, StaticSolver | ImplicitSolver | ExplicitSolver)
    design = design_of(posed)
    _, gradient, _ = sim.Evaluator(posed, plan)(design)
    skipping_none = replace(plan, solver=replace(solver, topology=complete))
    _, full, _ = sim.Evaluator(posed, skipping_none)(design)
    assert relative(gradient, full) < NEGLIGIBLE


@pytest.mark.parametrize("changes", [PUSHED, {"duration": 0.05}], ids=["static", "in time"])
def test_a_gradient_by_stiffness_skips_no_ligament(changes: dict[str, Any]) -> None:
    """A plan for designs leaves out the ligaments that they cannot change: not so by constants."""
    posed = scene(**{"motions": SHAKEN_ALONG_ONE, **changes})
    solver = sim.make_plan(posed).solver
    assert len(solver.topology.designed) < posed.lattice.n_ligaments
    values = sim.concrete_parameters(posed, posed.lattice.vertices)
    outside = np.ones((posed.lattice.n_ligaments, 1))
    outside[solver.topology.designed] = 0.0

    def loss(step: Any) -> Any:  # noqa: ANN401
        law = values.law * (1.0 + step * outside)
        moved = differentiable_motion(solver, values._replace(law=law), posed.loads.cases)
        return jnp.sum(moved.displacement[0, -1, posed.objective.region] ** 2)

    difference = float(central(loss, 1e-4))
    assert abs(difference) > 1e-6
    assert float(jax.grad(loss)(0.0)) == pytest.approx(difference, rel=1e-3)


def test_the_evaluator_is_the_derivative_of_the_losses() -> None:
    motions = (*SHAKEN_ALONG_ONE, sim.Harmonic(3.0, 5.0, 1.6))
    posed = scene(motions=motions, weights=np.array([0.3, 0.7]))
    plan, design = sim.make_plan(posed), design_of(posed)
    loss, gradient, each = sim.Evaluator(posed, plan)(design)
    np.testing.assert_allclose(each, sim.simulate(posed, design, plan=plan).losses, rtol=1e-13)
    assert loss == pytest.approx(0.3 * each[0] + 0.7 * each[1], rel=1e-13)
    by_jax = jax.grad(lambda x: sim.simulate(posed, x, plan=plan).loss)(jnp.asarray(design))
    assert relative(gradient, np.asarray(by_jax)) < NEGLIGIBLE


@cases("sim", "changes, integrator")
def test_integrators_fit_the_scene_or_are_chosen(changes: dict[str, Any], integrator: str) -> None:
    plan = sim.make_plan(scene(**changes))
    assert plan.integrator == integrator
    assert plan.describe().startswith(f"integrator: {integrator}")


def test_the_grid_depends_on_the_drive_and_not_on_the_design() -> None:
    knots = np.linspace(0.0, 0.2, 9)
    push = np.outer(np.sin(np.pi * knots / 0.2) ** 2, [2.0, 0.5, 0.02])
    posed = scene(motions=(sim.TimeSeries(knots, push),), weights=np.ones(1), frequency=None)
    plan = sim.make_plan(posed)
    assert isinstance(plan.solver, ImplicitSolver)
    assert any("adapted" in line for line in plan.decisions)
    assert np.diff(plan.solver.times).max() / np.diff(plan.solver.times).min() > 2
    assert sim.Evaluator(posed, plan)(np.zeros(posed.space.n_variables))[0] > 0
    posed = scene()
    one = sim.make_plan(posed).solver
    other = sim.make_plan(posed, vertices=np.asarray(posed.space.vertices(design_of(posed)))).solver
    assert isinstance(one, ImplicitSolver)
    assert isinstance(other, ImplicitSolver)
    np.testing.assert_array_equal(one.times, other.times)


def test_a_plan_tells_what_it_skips_and_can_be_stored() -> None:
    plan = sim.make_plan(scene(symmetry="C4"))
    told = plan.describe()
    for part in ("unloaded reference", "2 of 4 load cases", "parameter derivatives", "contact of"):
        assert any(part in line for line in told.splitlines() if line.startswith("skipped: "))
    assert json.loads(json.dumps(plan.record())) == plan.record()
