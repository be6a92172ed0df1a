import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sim.core import Floats
from sim.scene import Evaluator, Scene, combined, make_plan
from sim.solvers import Harmonic, Pulse
from sim.structure import Copies, Perturbation, draw_copies
from tests.sim.scene.test_plan import ANGLES, design_of, scene
from tests.sim.structures import central
from tests.tables import some

LOSSES, WEIGHTS = jnp.array([0.2, 1.0, 0.7]), jnp.array([0.5, 0.25, 0.25])


def test_the_p_mean_goes_from_the_mean_to_the_largest() -> None:
    assert combined(LOSSES, WEIGHTS, 1.0) == pytest.approx(0.525)
    found = [float(combined(LOSSES, WEIGHTS, p)) for p in (1.0, 2.0, 8.0, 64.0)]
    assert found == sorted(found)
    assert 0.97 < found[-1] < 1.0
    assert found[1] == pytest.approx(np.sqrt(0.5 * 0.04 + 0.25 * 1.0 + 0.25 * 0.49))
    slope = jax.grad(lambda x: combined(x, WEIGHTS, 8.0))(LOSSES)
    steps = np.eye(3)
    found = central(lambda h: [float(combined(LOSSES + h * e, WEIGHTS, 8.0)) for e in steps], 1e-6)
    np.testing.assert_allclose(slope, found, rtol=1e-6, atol=1e-9)
    value, slope = jax.value_and_grad(lambda x: combined(x, WEIGHTS, 8.0))(0.0 * LOSSES)
    assert float(value) == 0.0
    np.testing.assert_array_equal(slope, 0.0)


def robust(angles: Floats = ANGLES) -> Scene:
    """Two frequencies along some directions, and two imperfect copies."""
    posed = scene()
    copies = draw_copies(posed.lattice, Perturbation(geometry=0.3, ligaments=0.1), 2, seed=7)
    motions = tuple(Harmonic(a, f, angle) for a, f in ((3.0, 5.0), (2.0, 10.0)) for angle in angles)
    weights = np.repeat([0.6, 0.4], len(angles)) / len(angles)
    return scene(
        motions=motions, weights=weights, frequency=10.0, sharpness=8.0, copies=copies, samples=21
    )


@pytest.mark.parametrize("sharpness", some([8.0, 1.0], 1))
def test_the_evaluator_is_the_derivative_of_the_p_mean_over_copies(sharpness: float) -> None:
    posed = robust(ANGLES[1:2]).updated(copy_sharpness=sharpness, duration=0.05)
    evaluate = Evaluator(posed, make_plan(posed))
    design = design_of(posed, 0.2)
    value, gradient, each = evaluate(design)
    assert each.shape == (2,)
    assert posed.loads.case_weights @ each < value < each.max()
    steepest = float(np.linalg.norm(gradient))
    way = gradient / steepest
    found = central(lambda h: evaluate(design + h * way)[0], 1e-4)
    assert steepest == pytest.approx(found, rel=1e-4)
    assert posed.design.copies is not None
    alone = []
    for copy in range(2):
        part = slice(copy, copy + 1)
        of = posed.design.copies
        one = posed.updated(copies=Copies(of.shifts[part], of.stiffness[part]))
        alone.append(Evaluator(one, make_plan(one))(design)[0])
    mean = np.mean(np.array(alone) ** sharpness) ** (1 / sharpness)
    assert value == pytest.approx(mean, rel=1e-12)
    assert alone[0] != pytest.approx(alone[1], rel=1e-3)


def test_turned_copies_of_cases_are_skipped_for_each_load() -> None:
    plan = make_plan(robust().updated(copies=None, symmetry="C4"))
    np.testing.assert_array_equal(plan.case_of, [0, 1, 0, 1, 4, 5, 4, 5])


def test_a_pulse_peaks_after_its_delay_and_is_gone() -> None:
    motion = np.asarray(Pulse(2.0, 0.01, np.pi / 2, 0.04)(jnp.array([0.0, 0.04, 0.05, 0.2])))
    np.testing.assert_allclose(motion[:, 1], [2 * np.exp(-16), 2.0, 2 / np.e, 0.0], atol=1e-12)
    np.testing.assert_allclose(motion[:, [0, 2]], 0.0, atol=1e-12)
