import jax.numpy as jnp
import numpy as np
import pytest

from sim.energy import Kinematics
from sim.energy.ligament_kernels import gradient
from sim.scene import (
    DisplacementMimicking,
    Evaluator,
    Scene,
    SceneError,
    StrainEnergyMimicking,
    evaluate,
    make_plan,
    mimicking,
    simulate,
    strain_energies,
)
from sim.scene.objectives import RelativeMimicking, extent
from sim.solvers import Harmonic, LinearRamp, PrescribedMotion, Superposition, TimeSeries
from sim.time_integration import simpson_weights
from tests.sim.load_family.test_load_family import mimicked
from tests.sim.scene.test_plan import design_of
from tests.sim.structures import LEFT, Rig, pressed, rotating_squares, some_ligaments, taylor_orders

RIG = Rig(rotating_squares(), np.array([0, 4]), np.array([12]), Harmonic(1.0, 2.0))
MOTION = np.random.default_rng(2).normal(size=(2, 5, 25, 3)) * [1.0, 1.0, 0.1]
WEIGHTS = simpson_weights(5, 1.0)
SIDES = np.concatenate([LEFT, LEFT + 4])


def test_displacement_mimicking_is_the_papers_sum() -> None:
    units = np.array([3, 7, 20])
    losses = DisplacementMimicking(units, 15.0, WEIGHTS)(jnp.asarray(MOTION), RIG.values)
    for case in range(2):
        wanted = 0.0
        for time in range(5):
            ux, uy, theta = MOTION[case, time, units].T
            wanted += WEIGHTS[time] * np.sum((ux / 15) ** 2 + (uy / 15) ** 2 + theta**2)
        assert float(losses[case]) == pytest.approx(wanted, rel=1e-13)


def test_a_missed_target_is_relative_and_another_refused() -> None:
    units = np.array([3, 7, 20])
    target = MOTION[:, :, units]
    size = extent(target, 15.0)[:, -1]
    measure = RelativeMimicking(units, 15.0, WEIGHTS, target, size)
    losses = measure(jnp.zeros_like(MOTION), RIG.values)
    every = DisplacementMimicking(units, 15.0, WEIGHTS)(jnp.asarray(MOTION), RIG.values)
    np.testing.assert_allclose(losses, np.sqrt(every) / size, rtol=1e-13)
    # one that is met costs nothing
    measure = RelativeMimicking(units, 15.0, WEIGHTS, target, np.ones(2))
    np.testing.assert_array_equal(measure(jnp.asarray(MOTION), RIG.values), 0.0)
    fewer = measure._replace(target=MOTION[:1, :, units])
    with pytest.raises(ValueError, match=r"\(1, 5, 3\) load cases.* give the reference"):
        fewer(jnp.asarray(MOTION), RIG.values)


def test_strain_energies_are_the_kernels() -> None:
    ligaments = np.array([0, 7, 31])
    units, values = RIG.lattice.ligament_units[ligaments], RIG.values
    found = strain_energies(jnp.asarray(MOTION), values, ligaments, units)
    net = RIG.topology.network(values)
    force, kinematics = np.empty(75), Kinematics(np.empty((25, 4)), np.empty(1))
    for case, time, k in np.ndindex(2, 5, 3):
        alone = some_ligaments(net, ligaments[k : k + 1])
        energy = gradient(MOTION[case, time].ravel(), alone, kinematics, force)
        assert found[case, time, k] == pytest.approx(energy, rel=1e-12)
    losses = StrainEnergyMimicking(ligaments, units, WEIGHTS)(jnp.asarray(MOTION), values)
    np.testing.assert_allclose(losses, np.asarray(found).sum(axis=2) @ WEIGHTS, rtol=1e-13)


def test_the_force_of_the_cut_ligaments_is_that_of_the_drive() -> None:
    """And as a part of what is mimicked the loss is the sum of both errors."""
    scene = mimicked().updated(reaction=0.5)
    response = simulate(scene, design_of(scene, 0.2))
    measure = mimicking(scene)
    force = measure.force(response.displacement, response.parameters)  # type: ignore[union-attr]
    np.testing.assert_allclose(force, response.drive_force, rtol=1e-9, atol=1e-9)
    intact = simulate(scene.objective.reference).drive_force  # type: ignore[arg-type]
    np.testing.assert_allclose(measure.target, intact, rtol=1e-9, atol=1e-9)  # type: ignore[union-attr]
    design = design_of(scene, 0.2)
    evaluate = Evaluator(scene, make_plan(scene))
    value, gradient, _ = evaluate(design)
    alone = Evaluator(scene.updated(reaction=0.0), make_plan(scene))(design)[0]
    assert scene.objective.reference is not None
    forces = [simulate(scene, design).drive_force, simulate(scene.objective.reference).drive_force]
    missed, size = np.linalg.norm(forces[0] - forces[1]), np.linalg.norm(forces[1][0, -1])
    assert value == pytest.approx(alone + 0.5 * missed / size, rel=1e-9)
    way = gradient / np.linalg.norm(gradient)
    ahead = taylor_orders(
        lambda step: evaluate(design + step * way)[0], gradient @ way, np.array([2e-3, 1e-3])
    )
    np.testing.assert_allclose(ahead, 2.0, atol=0.07)


def squeezed_between(*cases: PrescribedMotion) -> Scene:
    """Nothing is clamped; the force of the undesigned structure is mimicked."""
    made = pressed(1.0, cases=cases, supports=())
    return made.updated(reference=made, reaction=1.0)


def test_the_force_is_that_of_the_units_of_each_drive() -> None:
    """The other side, held for another case or driven as well, carries the opposite force."""
    ways = LinearRamp(1.0, 1.0), LinearRamp(-1.0, 1.0)
    left, right = map(PrescribedMotion, (LEFT, LEFT + 4), ways)
    both = PrescribedMotion(SIDES, Superposition(ways, np.repeat(np.eye(2), 5, axis=0)))
    for cases, sides in (((left, right), (LEFT, LEFT + 4)), ((both,), (LEFT,))):
        scene = squeezed_between(*cases)
        measure, response = mimicking(scene), simulate(scene)
        force = measure.force(response.displacement, response.parameters)  # type: ignore[union-attr]
        for case, units in enumerate(sides):
            wanted = response.observables[case].force_on(units)
            np.testing.assert_allclose(force[case], wanted, rtol=1e-9, atol=1e-9)
            assert abs(wanted[-1, 0]) > 0.1
        np.testing.assert_allclose(response.losses, 0.0, atol=1e-9)


@pytest.mark.parametrize("reaction", [0.0, 0.5])
def test_a_motion_that_is_met_exactly_has_no_slope(reaction: float) -> None:
    """The root of the squares has one to each side."""
    made = pressed(1.0, reaction=reaction)
    loss, gradient = evaluate(made.updated(reference=made))
    assert loss == 0.0
    np.testing.assert_array_equal(gradient, 0.0)


def test_losses_are_in_the_order_of_the_load_cases() -> None:
    """Compares each with its own target, whichever was simulated first."""
    ways = (LinearRamp(1.0, 1.0), LinearRamp(-2.0, 1.0))
    left, right = map(PrescribedMotion, (LEFT, LEFT + 4), ways)
    scene = squeezed_between(left, right)
    np.testing.assert_allclose(simulate(scene, cases=(1, 0)).losses, 0.0, atol=1e-9)


def test_a_drive_whose_forces_balance_has_none_to_mimic() -> None:
    ends = np.zeros((2, 10, 3))
    ends[1, :, 0] = np.repeat([1.0, -1.0], 5)
    scene = squeezed_between(PrescribedMotion(SIDES, TimeSeries(np.array([0.0, 1.0]), ends)))
    with pytest.raises(SceneError, match=r"load case 0 .* balance .* leave the reac") as refusal:
        mimicking(scene)
    assert refusal.value.key == "objective.reaction"
