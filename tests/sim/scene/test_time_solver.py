"""Steps are as short as the accuracy asks for, whatever the drive does and whatever rings."""

import logging
from dataclasses import replace
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

import sim
from benchmarks.scenes import MATERIAL
from sim.scene import concrete_parameters, estimated_errors, sample_times, scales
from sim.scene.time_solver import RULES, distinct_drives, expected_steps
from sim.solvers import FORCE, breakpoints, solve_case
from sim.structure import ContactModel
from sim.time_integration import ExplicitSolver, ImplicitSolver
from tests.sim.scene.test_plan import design_of
from tests.sim.scene.test_plan import scene as seven_by_seven
from tests.sim.structures import central, rotating_squares, taylor_orders
from tests.tables import some

KNOTS = np.linspace(0.0, 0.2, 201)
SPIKE = np.where(np.arange(201) == 120, 0.3, 0.0)[:, None] * [1.0, 0.5, 0.0]
DRIVES: dict[str, sim.MotionLaw] = {
    "slow": sim.Harmonic(3.0, 5.0, 0.6),
    "near the lowest eigenfrequency": sim.Harmonic(2.0, 60.0, 0.6),
    "a short late pulse": sim.Pulse(2.0, 0.002, 0.6, 0.13),
    "a spike": sim.TimeSeries(KNOTS, SPIKE),
}


def posed(motion: sim.MotionLaw, **changes: Any) -> sim.Scene:  # noqa: ANN401  (fields of a scene)
    return seven_by_seven((motion,), weights=np.ones(1), **changes)


@pytest.mark.parametrize("drive", some(DRIVES))
def test_errors_are_those_that_were_asked_for_and_stated(drive: str) -> None:
    scene = posed(DRIVES[drive])
    values, times = sim.concrete_parameters(scene, scene.lattice.vertices), sim.sample_times(scene)
    fine = ExplicitSolver(scene.topology, float(times[-1]), 20_000, times)
    exact = solve_case(fine, values, scene.loads.cases[0])[0]
    response = sim.simulate(scene, vertices=scene.lattice.vertices)
    finer = response.refined()
    seen = [
        motion.reshape(len(times), -1, 3)[:, scene.objective.region] / scales(15.0)
        for motion in (response.displacement, finer.displacement, exact)
    ]
    true = np.linalg.norm(seen[0] - seen[2]) / np.linalg.norm(seen[2])
    losses = float(response.loss), float(finer.loss)
    stated, stated_loss = estimated_errors((seen[0], seen[1]), losses, losses[1])
    right = float(replace(response, displacement=exact.reshape(1, len(times), -1, 3)).loss)
    assert true < RULES["default"].motion
    assert abs(losses[0] / right - 1) < RULES["default"].loss
    assert true / 3 < stated < 5 * true
    assert abs(losses[0] / right - 1) / 3 < stated_loss


def test_a_motion_of_units_without_mass_is_refused() -> None:
    scene = posed(DRIVES["slow"])
    weightless = scene.updated(material=scene.structure.material._replace(density=0.0))
    for integrator in ("auto", "explicit"):
        with pytest.raises(sim.SimulationError, match="unit 0 has no mass"):
            sim.make_plan(weightless.updated(integrator=integrator))


def test_a_pushed_structure_that_floats_is_followed_as_by_explicit_steps() -> None:
    """Its slow push has no end, and so no share that a step may miss."""
    push = sim.PrescribedMotion(
        np.array([5]), sim.Pulse(1.0, 0.02, 0.0, 0.08), np.array([[FORCE, 0, 0]])
    )
    floating = sim.Scene(
        sim.Structure(rotating_squares(4), MATERIAL),
        sim.Loads((push,), duration=0.2),
        sim.Objective(region=np.array([0, 3, 12, 15]), samples=51),
        numerics=sim.Numerics("draft", "implicit"),
    )
    one, other = (
        sim.simulate(floating.updated(integrator=name), vertices=floating.lattice.vertices)
        for name in ("implicit", "explicit")
    )
    assert one.plan.warnings == ()
    np.testing.assert_allclose(one.losses, other.losses, rtol=RULES["draft"].loss)


def test_numbers_of_a_drive_may_be_arrays() -> None:
    one, other = sim.Harmonic(3.0, 5.0, 0.6), sim.Harmonic(jnp.array(3.0), jnp.array(5.0), 1.0)
    scene = posed(one)
    assert len(distinct_drives(scene.driven_by(one, other))) == 1


@pytest.mark.parametrize("drive", some(["a short late pulse", "a spike"], 1))
def test_implicit_steps_end_where_a_drive_turns(drive: str) -> None:
    scene = posed(DRIVES[drive], integrator="implicit", accuracy="draft")
    solver = sim.make_plan(scene).solver
    assert isinstance(solver, ImplicitSolver)
    turns = breakpoints(DRIVES[drive], 0.2)
    assert len(turns) >= 3
    assert np.abs(solver.times[:, None] - turns).min(axis=0).max() < 1e-9


@pytest.mark.parametrize(
    ("motion", "duration"),
    [
        (sim.Harmonic(3.0, 2.0, 0.6), 1.0),
        (DRIVES["near the lowest eigenfrequency"], 0.2),
        (DRIVES["a short late pulse"], 0.2),
    ],
)
def test_steps_are_guessed_without_a_solve(motion: sim.MotionLaw, duration: float) -> None:
    scene = posed(motion, duration=duration, frequency=getattr(motion, "frequency", None))
    values, solver = concrete_parameters(scene, scene.lattice.vertices), sim.make_plan(scene).solver
    integrator, guessed = expected_steps(scene, values, sample_times(scene))
    if isinstance(solver, ImplicitSolver):
        steps, kind = len(solver.times) - 1, "implicit"
    else:
        assert isinstance(solver, ExplicitSolver)
        steps, kind = solver.n_steps, "explicit"
    assert integrator == kind
    assert 0.5 < guessed / steps < 2


@pytest.mark.parametrize(
    ("motion", "fewer"),
    [
        (DRIVES["slow"], 0.8),
        (DRIVES["near the lowest eigenfrequency"], 0.8),
        (sim.Harmonic(3e-3, 5.0, 0.6), 1.0),
    ],
)
def test_stages_are_solved_as_a_motion_needs_it_where_no_gradient_does(
    motion: sim.MotionLaw, fewer: float
) -> None:
    scene = posed(motion, integrator="implicit", accuracy="draft")
    still = scene.lattice.vertices
    motions, gradients = [], []
    for gradient in (True, False):
        plan = sim.make_plan(scene, still, gradient=gradient)
        assert isinstance(plan.solver, ImplicitSolver)
        assert plan.solver.topology.numbering[1].storage == "panels"
        found = sim.simulate(scene, vertices=still, plan=plan)
        motions.append(found.displacement[..., scene.objective.region, :] / scales(15.0))
        gradients.append(found.records[0].counts[0])
    apart = np.linalg.norm(motions[1] - motions[0]) / np.linalg.norm(motions[0])
    assert apart < RULES["draft"].motion / 20
    assert gradients[1] <= fewer * gradients[0]


def test_a_straight_series_has_no_kinks() -> None:
    ramp = np.outer(KNOTS, [1.0, 2.0, 0.0])
    assert len(breakpoints(sim.TimeSeries(KNOTS, ramp), 0.2)) == 0
    np.testing.assert_allclose(breakpoints(sim.TimeSeries(KNOTS, SPIKE), 0.2), [0.119, 0.12, 0.121])


def test_explicit_steps_of_a_tight_run_are_shorter() -> None:
    found = {}
    for accuracy in ("default", "tight"):
        scene = posed(DRIVES["a short late pulse"], integrator="explicit", accuracy=accuracy)
        solver = sim.make_plan(scene).solver
        assert isinstance(solver, ExplicitSolver)
        found[accuracy] = solver.n_steps
    assert found["tight"] > 1.5 * found["default"]


def test_drives_that_differ_by_direction_are_tried_once() -> None:
    scene = seven_by_seven(
        (*(sim.Harmonic(3.0, 5.0, k) for k in (0.0, 1.0)), sim.Harmonic(3.0, 6.0))
    )
    assert len(distinct_drives(scene)) == 2


def test_the_change_of_a_loss_may_vanish_but_not_its_stated_error() -> None:
    one, other = np.array([1.0, 0.1]), np.array([1.0, -0.1])
    motion, loss = estimated_errors((one, other), (2.0, 2.0), 2.0)
    assert loss == pytest.approx(motion**2)
    assert motion > 0.2
    assert estimated_errors((0 * one, 0 * one), (0.0, 0.0), 0.0) == (0.0, 0.0)
    assert estimated_errors((one, 0 * one), (1.0, 0.0), 0.0) == (np.inf, np.inf)


@pytest.mark.parametrize("law", [None, sim.DistanceContact(2.25 / 12)], ids=["angles", "distances"])
def test_the_gradient_is_that_of_the_loss_to_almost_all_digits(law: ContactModel | None) -> None:
    """Stages solved to 5e-3 mm/s left a slope of 1.05 and differences that agree to 8e-5."""
    scene = posed(DRIVES["slow"], integrator="implicit", duration=0.4)
    scene = scene if law is None else scene.with_contact(law)
    assert isinstance(scene.structure.contact, type(law) if law else sim.VoidAngleContact)
    evaluate, design = sim.Evaluator(scene), design_of(scene, 0.1)
    direction = np.random.default_rng(1).uniform(-1, 1, len(design))
    loss, gradient, _ = evaluate(design)
    slope, steps = gradient @ direction, np.geomspace(1e-2, 1e-4, 3)

    def value(step: float) -> float:
        return evaluate(design + step * direction)[0]

    np.testing.assert_allclose(taylor_orders(value, slope, steps), 2.0, atol=0.02)
    assert abs(value(1e-4) - loss - 1e-4 * slope) < 1e-10 * loss
    assert slope == pytest.approx(central(value, 1e-4), rel=2e-7)


def test_an_optimiser_checks_its_steps_at_start_and_end(caplog: pytest.LogCaptureFixture) -> None:
    scene = posed(DRIVES["slow"], integrator="implicit")
    plan, limits = sim.make_plan(scene), sim.Limits(edge_length=5.0)
    with caplog.at_level(logging.INFO, "sim.scene.evaluation"):
        for asked in (scene, scene.updated(accuracy="tight")):
            sim.minimise(asked, limits, options=sim.SqpOptions(evaluations=2), plan=plan)
    told = [record.message for record in caplog.records if record.levelname == "INFO"]
    warned = [record for record in caplog.records if record.levelname == "WARNING"]
    places = [name for line in told for name in ("start", "end") if name in line]
    assert places == ["start", "end"] * 2
    assert len(warned) == 2
    assert "tight" in warned[0].message
