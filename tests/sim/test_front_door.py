"""The public face of sim: what it loads, what it gives, and what JAX may do with it."""

import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import sim
from tests.sim.structures import central, pressed

EXAMPLE = Path(__file__).parents[2] / "docs/example_sim.py"


def run(script: str, *arguments: str) -> str:
    """What a script prints in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_any_room_of_sim_switches_to_float64() -> None:
    """Each is imported first in its turn; the switch itself is put back in between."""
    script = "\n".join(
        (
            "import importlib, sys, jax",
            "for name in sys.argv[1:]:",
            "    for loaded in [m for m in sys.modules if m.split('.')[0] == 'sim']:",
            "        del sys.modules[loaded]",
            "    jax.config.update('jax_enable_x64', False)",
            "    importlib.import_module(name)",
            "    if not jax.config.jax_enable_x64:",
            "        print(name)",
        )
    )
    rooms = sorted(f"sim.{path.parent.name}" for path in Path("sim").glob("*/__init__.py"))
    assert len(rooms) > 8
    assert run(script, *rooms) == ""


def test_the_example_lowers_its_loss_and_needs_sim_alone() -> None:
    """As it is printed in docs/."""
    told = run(EXAMPLE.read_text())
    # the plan above names an allowed loss error, too
    before, after = map(float, re.findall(r"loss (\d\.\d+)", told.splitlines()[-1]))
    assert before == pytest.approx(0.0467, abs=1e-4)
    assert after == pytest.approx(0.0023, abs=2e-4)
    force = float(re.findall(r"drive (\d\.\d+) N", told)[0])
    assert force == pytest.approx(3.759, abs=2e-3)
    text = EXAMPLE.read_text()
    code = [line for line in text.splitlines() if line.strip()]
    assert len(code) <= 40
    assert "sim.simulate(" in "".join(code[:20])
    imported = set(re.findall(r"^(?:from|import) (\w+)", text, re.MULTILINE))
    assert imported == {"numpy", "sim"}


@cache
def scene() -> sim.Scene:
    return pressed(2.0, cloak=np.array([6, 8, 16, 18]))


def design(size: float = 0.3) -> np.ndarray:
    return size * np.random.default_rng(1).uniform(-1, 1, scene().space.n_variables)


def test_a_response_holds_motion_forces_and_loss() -> None:
    response = sim.simulate(scene())
    np.testing.assert_array_equal(response.times, [0.5, 1.0])
    assert response.displacement.shape == response.velocity.shape == (1, 2, 25, 3)
    np.testing.assert_allclose(response.displacement[0, -1, 4::5, 0], -2.0)
    pushed = response.drive_force[0, :, 0]
    assert (pushed[1] < pushed[0] < 0).all()
    held = response.observables[0].reaction[:, 5 * np.arange(5), 0].sum(axis=1)
    np.testing.assert_allclose(held, -pushed, rtol=1e-6)
    loss, _ = sim.evaluate(scene())
    assert float(response.loss) == pytest.approx(loss, rel=1e-12)


def test_evaluations_by_a_plan_of_ones_own_are_not_mixed_up() -> None:
    """Compiled functions are kept for a scene and a plan; another plan finds none of them."""
    twice = scene().driven_by(sim.LinearRamp(-2.0, 1.0), sim.LinearRamp(-1.0, 1.0))
    plan = sim.make_plan(twice)
    both, _ = sim.evaluate(twice, design(), plan)
    first, _ = sim.evaluate(twice, design(), replace(plan, case_of=np.zeros(2, dtype=int)))
    losses = sim.simulate(twice, design(), plan=plan).losses
    assert (both, first) == pytest.approx((float(losses.mean()), float(losses[0])), rel=1e-9)


def test_a_structure_is_given_by_its_design_or_its_vertices() -> None:
    by_design = sim.simulate(scene(), design()).displacement
    vertices = np.asarray(scene().space.vertices(design()))
    by_vertices = sim.simulate(scene(), vertices=vertices, plan=sim.make_plan(scene()))
    np.testing.assert_allclose(by_design, by_vertices.displacement, atol=1e-12)


def test_a_plan_keeps_its_times_and_takes_threads() -> None:
    plan = sim.make_plan(scene(), threads=2)
    with pytest.raises(ValueError, match="a plan has its own times"):
        sim.simulate(scene(), times=np.array([0.5]), plan=plan)
    taken = [
        sim.simulate(scene(), plan=plan, threads=asked).plan.solver.threads for asked in (None, 3)
    ]
    assert taken == [2, 3]


def test_times_and_cases_can_be_chosen() -> None:
    motions = [sim.LinearRamp(-2.0, 1.0, angle) for angle in (0.0, 0.4)]
    two = scene().driven_by(*motions)
    one = sim.simulate(two, times=np.array([0.25, 1.0]), cases=[1])
    both = sim.simulate(two)
    assert one.displacement.shape == (1, 2, 25, 3)
    np.testing.assert_allclose(one.displacement[0, 1], both.displacement[1, 1], atol=1e-9)
    alone = sim.simulate(two.alone(1))
    np.testing.assert_array_equal(alone.displacement[0], both.displacement[1])
    with pytest.raises(ValueError, match="sample_times"):
        _ = one.losses
    region = {"region": np.array([6, 7]), "steps": 2}
    mimicking = two.updated(**region, reference=two.updated(**region))
    wider = mimicking.updated(material=two.structure.material._replace(bending_stiffness=3.0))
    losses = sim.simulate(wider).losses
    assert float(sim.simulate(wider.alone(1)).loss) == pytest.approx(float(losses[1]), rel=1e-9)


def test_a_response_with_half_the_steps_is_near() -> None:
    shaken = scene().driven_by(sim.Harmonic(1.0, 20.0), duration=0.05, static=False, steps=None)
    assert shaken.loads.drive_frequency == 20.0
    response = sim.simulate(shaken.updated(samples=21))
    finer = response.refined()
    largest = np.abs(response.displacement).max()
    assert 0 < np.abs(finer.displacement - response.displacement).max() < 1e-2 * largest


def test_the_law_of_contact_is_one_value() -> None:
    near = scene().with_contact(sim.DistanceContact(0.2))
    assert sim.simulate(near).observables[0].contact_pairs.max() == 0
    by_angle, by_distance = (sim.simulate(each).displacement for each in (scene(), near))
    np.testing.assert_allclose(by_angle, by_distance, atol=1e-9)


def test_the_gradient_of_ones_own_loss_is_that_of_its_differences() -> None:
    plan, direction = sim.make_plan(scene()), design()

    def energy(x: Any) -> Any:  # noqa: ANN401
        return jnp.sum(sim.simulate(scene(), x, plan=plan).displacement[0, -1, 12] ** 2)

    start = np.zeros_like(direction)
    slope = float(jax.grad(energy)(jnp.asarray(start)) @ direction)
    assert slope == pytest.approx(float(central(lambda h: energy(h * direction), 1e-3)), rel=1e-5)
    by_jax = jax.grad(lambda x: sim.simulate(scene(), x, plan=plan).loss)(jnp.asarray(start))
    np.testing.assert_allclose(by_jax, sim.evaluate(scene(), start)[1], rtol=1e-9, atol=1e-12)


def _loss(x: Any) -> Any:  # noqa: ANN401
    return sim.simulate(scene(), x, plan=sim.make_plan(scene())).losses[0]


def _motion(x: Any) -> Any:  # noqa: ANN401
    return sim.simulate(scene(), x, plan=sim.make_plan(scene())).displacement[0, -1, 12]


@pytest.mark.parametrize(
    ("transformed", "message"),
    [
        (jax.jit(_loss), "cannot be traced"),
        (lambda x: jax.vmap(_loss)(jnp.stack([x, x])), "cannot be traced"),
        (lambda x: jax.jvp(_loss, (x,), (x,)), "no forward derivative"),
        (jax.jacfwd(_loss), "forward derivative|cannot be traced"),
        (jax.jacrev(_motion), "cannot be traced"),
        (jax.hessian(_loss), "forward derivative|cannot be traced"),
        (jax.grad(jax.jit(_loss)), "cannot be traced"),
    ],
    ids=["jit", "vmap", "jvp", "jacfwd", "jacrev", "hessian", "grad of jit"],
)
def test_other_transforms_are_refused(transformed: Callable[[Any], Any], message: str) -> None:
    with pytest.raises(TypeError, match=message):
        transformed(jnp.asarray(design()))


@pytest.mark.parametrize("missing", ["cloak", "region"])
def test_what_is_missing_for_a_loss_is_named(missing: str) -> None:
    with pytest.raises(ValueError, match=f"no {missing}"):
        sim.evaluate(scene().updated(**{missing: np.array([], dtype=int)}))
    with pytest.raises(TypeError, match="amplitude"):
        scene().updated(amplitude=2.0)


def test_a_cloak_lowers_the_loss_and_can_be_made() -> None:
    limits = sim.Limits(edge_length=5.0, void_angle=0.0)
    best = sim.minimise(scene(), limits, options=sim.SqpOptions(evaluations=4))
    assert best.loss < 0.9 * sim.evaluate(scene())[0]
    assert float(sim.simulate(scene(), best.x).loss) == pytest.approx(best.loss, rel=1e-6)
