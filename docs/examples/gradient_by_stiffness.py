"""A gradient by stiffness: how the force of a press depends on the constants of the ligaments."""

import jax
import jax.numpy as jnp
import numpy as np
from specimen import PLA, panels, pressed, squares

import sim

lattice = squares(6, 6)
scene = pressed(lattice, shortening=6.0)
plan = sim.make_plan(scene, lattice.vertices, np.array([1.0]))
inner = jnp.asarray(np.setdiff1d(np.arange(lattice.n_units), scene.loads.driven))


def lateral_bulge(constants):
    """Mean square of the sideways motion (mm^2) for (axial, shear, bending) stiffness."""
    names = ("axial_stiffness", "shear_stiffness", "bending_stiffness")
    material = PLA._replace(**dict(zip(names, constants, strict=True)))
    shape = sim.structure.shape(lattice, lattice.vertices)
    values = sim.structure.parameters(lattice, shape, material)
    motion = sim.solvers.differentiable_motion(plan.solver, values, scene.loads.cases)
    return jnp.mean(motion.displacement[0, -1, inner, 0] ** 2)


constants = jnp.array([PLA.axial_stiffness, PLA.shear_stiffness, PLA.bending_stiffness])
bulge, slope = jax.value_and_grad(lateral_bulge)(constants)
elasticity = np.asarray(slope * constants / bulge)  # change in % for 1 % of each constant
axial, shear, bending = elasticity

figure, axes = panels(1)
axes.bar(["axial", "shear", "bending"], elasticity, color="black")
axes.set_ylabel("change of the bulge (% per %)")
