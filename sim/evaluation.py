"""Loss and gradient of a design: what the optimisers see."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.arrays import Floats
from sim.dynamics import simulate
from sim.geometry import shape
from sim.grid import simpson_weights
from sim.model import Parameters, parameters
from sim.objectives import DisplacementMimicking, StrainEnergyMimicking
from sim.plan import Plan
from sim.scene import Scene

Objective = DisplacementMimicking | StrainEnergyMimicking


def objective(scene: Scene) -> Objective:
    """The scene's loss as the mean over its duration, by Simpson's rule on its samples."""
    weights = simpson_weights(scene.samples, 1.0)
    if scene.objective == "displacement":
        return DisplacementMimicking(scene.region, scene.lattice.spacing, weights)
    ligaments = scene.region_ligaments
    return StrainEnergyMimicking(ligaments, scene.lattice.ligament_units[ligaments], weights)


def structure(scene: Scene) -> Callable[[Array], Parameters]:
    """Compiled map from a design vector to the parameters of its structure."""

    @jax.jit
    def of_design(design: Array) -> Parameters:
        made = shape(scene.lattice, scene.space.vertices(design))
        return parameters(scene.lattice, made, scene.material)

    return of_design


def losses(scene: Scene, plan: Plan) -> Callable[[Array], Array]:
    """Differentiable map from a design vector to the losses (n_cases,) of all load cases."""
    of_design = structure(scene)
    measure = jax.jit(objective(scene).__call__)
    drives = tuple(scene.drives[case] for case in plan.simulated)
    place = np.searchsorted(plan.simulated, plan.case_of)

    def of_cases(design: Array) -> Array:
        values = of_design(design)
        response = simulate(plan.solver, values, drives)
        return measure(response.displacement, values)[place]

    return of_cases


def evaluator(scene: Scene, plan: Plan) -> Callable[[Floats], tuple[float, Floats, Floats]]:
    """Function from a design vector to loss, gradient (n_variables,) and losses of all cases.

    It raises ``SimulationError`` where the simulation fails.
    """
    of_cases = losses(scene, plan)
    weights = jnp.asarray(scene.weights)

    def mean(design: Array) -> tuple[Array, Array]:
        each = of_cases(design)
        return weights @ each, each

    with_gradient = jax.value_and_grad(mean, has_aux=True)

    def evaluate(design: Floats) -> tuple[float, Floats, Floats]:
        (loss, each), gradient = with_gradient(jnp.asarray(design))
        return float(loss), np.asarray(gradient), np.asarray(each)

    return evaluate
