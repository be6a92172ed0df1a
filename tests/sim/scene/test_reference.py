"""Agreement with the paper's own code on its scenes, at the accuracy that is promised."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

import sim
from sim.core import Floats
from sim.scene import Accuracy, DisplacementMimicking, StrainEnergyMimicking, parameters_of_design
from sim.solvers import differentiable_motion, solve_case
from sim.structure import shape
from tests.sim import reference_scenes as scenes


def test_lattice_is_the_references() -> None:
    lattice, stored = scenes.paper_lattice(), scenes.reference("A")
    made = shape(lattice, lattice.vertices)
    offset = stored["block_centroids_mm"][0]
    np.testing.assert_allclose(made.centroid, stored["block_centroids_mm"] - offset, atol=1e-10)
    np.testing.assert_allclose(
        made.arm, stored["centroid_node_vectors_mm"].reshape(-1, 2), atol=1e-10
    )
    np.testing.assert_array_equal(lattice.ligaments, stored["bond_connectivity"])
    np.testing.assert_allclose(
        lattice.ligament_vectors, stored["reference_bond_vectors_mm"], atol=1e-10
    )


def test_inertia_damping_and_regions_are_the_references() -> None:
    scene, stored = scenes.scene_a(), scenes.reference("A")
    values = sim.concrete_parameters(scene, scene.lattice.vertices)
    np.testing.assert_allclose(
        values.mass, stored["inertia_tonne_tonne_tonnemm2"], rtol=1e-11, atol=0
    )
    damping = stored["damping_per_dof_tonne_per_s_or_tonne_mm2_per_s"]
    np.testing.assert_allclose(values.damping, np.tile(damping, (225, 1)), rtol=1e-7)
    stored = scenes.reference("A")
    np.testing.assert_array_equal(scenes.scene_a().objective.region, stored["roi_blocks"])
    designed = sum(int(stored[f"mask_{kind}_design"].sum()) for kind in ("horizontal", "vertical"))
    assert scenes.scene_a().space.n_variables == 2 * designed == 304


Measure = DisplacementMimicking | StrainEnergyMimicking


class Outcome(NamedTuple):
    integrator: str
    motion: Floats
    loss: float
    gradient: Floats


def outcome_of(scene: sim.Scene, times: Floats, measure: Measure) -> Outcome:
    """Of the first load case of the regular lattice."""
    plan, of_design = sim.make_plan(scene, times=times), parameters_of_design(scene)

    def loss(design: Array) -> tuple[Array, Array]:
        values = of_design(design)
        response = differentiable_motion(plan.solver, values, scene.loads.cases)
        return measure(response.displacement, values)[0], response.displacement

    design = jnp.zeros(scene.space.n_variables)
    (value, motion), gradient = jax.value_and_grad(loss, has_aux=True)(design)
    return Outcome(plan.integrator, np.asarray(motion)[0], float(value), np.asarray(gradient))


def outcome_of_scene_a(accuracy: Accuracy) -> Outcome:
    scene, n_times = scenes.scene_a(accuracy=accuracy), len(scenes.SAMPLES)
    region = scene.objective.region
    measure = DisplacementMimicking(region, scene.lattice.spacing, np.ones(n_times))
    found = outcome_of(scene, scenes.SAMPLES, measure)
    return found._replace(motion=found.motion[:, region])


def relative(found: Floats, wanted: Floats) -> float:
    return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))


def assert_agrees_with_scene_a(found: Outcome, motion: float, loss: float, gradient: float) -> None:
    stored, scale = scenes.reference("A"), np.array([15.0, 15.0, 1.0])
    wanted = stored["roi_displacement_tight_mm_mm_rad"]
    by_shifts = scenes.group_gradient(scenes.scene_a(), "A", "grad_{}_shifts_rk4_discrete")
    assert relative(found.motion / scale, wanted / scale) <= motion
    assert abs(found.loss / stored["loss_tight"] - 1) <= loss
    assert relative(found.gradient, by_shifts) <= gradient


def test_scene_a_at_default_accuracy() -> None:
    found = outcome_of_scene_a("default")
    assert found.integrator == "implicit"
    assert_agrees_with_scene_a(found, motion=4e-3, loss=2e-4, gradient=3e-4)


def test_error_estimate_by_halving_the_steps() -> None:
    """Each step cut in two: what changes is the true error within a factor of 3."""
    scene, stored = scenes.scene_a(), scenes.reference("A")
    solver = sim.make_plan(scene, times=scenes.SAMPLES).solver
    values = sim.concrete_parameters(scene, scene.lattice.vertices)
    scale = np.array([15.0, 15.0, 1.0])

    def in_region(motion: Floats) -> Floats:
        return motion.reshape(len(scenes.SAMPLES), -1, 3)[:, scene.objective.region] / scale

    coarse, _, record = solve_case(solver, values, scene.loads.cases[0])
    fine = solve_case(solver.refined(record), values, scene.loads.cases[0])[0]
    found, finer = in_region(coarse), in_region(fine)
    exact = stored["roi_displacement_tight_mm_mm_rad"] / scale
    assert 1 / 3 < relative(found, finer) / relative(found, exact) < 3
    losses = [float(np.sum(motion**2)) for motion in (found, finer, exact)]
    assert 1 / 3 < (losses[0] - losses[1]) / (losses[0] - losses[2]) < 3


def static_measure(scene: sim.Scene, name: str, n_loads: int) -> StrainEnergyMimicking:
    ligaments = np.flatnonzero(scenes.reference(name)["roi_bond_mask"])
    return StrainEnergyMimicking(
        ligaments, scene.lattice.ligament_units[ligaments], np.ones(n_loads)
    )


@pytest.mark.parametrize("name", ["B", "C"])
def test_final_equilibrium(name: str) -> None:
    scene, stored = scenes.compressed(name), scenes.reference(name)
    found = outcome_of(scene, np.array([scene.loads.duration]), static_measure(scene, name, 1))
    np.testing.assert_allclose(found.motion[0], stored["static_u_eq_final"], rtol=0, atol=1e-7)
    np.testing.assert_allclose(found.loss, stored["static_final_loss_Nmm"], rtol=1e-9)
    wanted = scenes.group_gradient(scene, name, "static_final_grad_{}_shifts")
    assert relative(found.gradient, wanted) <= 1e-7


def test_path_of_scene_b() -> None:
    scene, stored = scenes.compressed("B"), scenes.reference("B")
    amplitudes = stored["static_path_amps_mm"]
    plan = sim.make_plan(scene, times=amplitudes)
    values = sim.concrete_parameters(scene, scene.lattice.vertices)
    motion = differentiable_motion(plan.solver, values, scene.loads.cases).displacement[0]
    np.testing.assert_allclose(motion, stored["static_path_u"], rtol=0, atol=1e-6)
    measure = static_measure(scene, "B", 1)
    each = [measure(state[None, None], values)[0] for state in motion]
    np.testing.assert_allclose(each, stored["static_path_roi_energy_Nmm"], rtol=1e-8)
