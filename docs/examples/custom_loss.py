"""A loss of one's own: JAX differentiates any function of the simulated motion."""

import jax
import jax.numpy as jnp
import numpy as np
from specimen import panels, pressed, squares

import sim

lattice = squares(6, 6)
middle = int(np.flatnonzero((lattice.index == 3).all(axis=1))[0])
scene = pressed(lattice, shortening=6.0).updated(
    cloak=np.flatnonzero((lattice.index > 0).all(axis=1) & (lattice.index < 5).all(axis=1))
)


def turn_of_the_middle(design):
    """Rotation (rad) of one unit at the end of the path."""
    return sim.simulate(scene, design).displacement[0, -1, middle, 2]


design = jnp.zeros(scene.space.n_variables)
turn, gradient = jax.value_and_grad(turn_of_the_middle)(design)
turn_deg = float(jnp.rad2deg(turn))
steepest = float(jnp.rad2deg(jnp.abs(gradient).max()))  # deg/mm

figure, axes = panels(1)
axes.bar(np.arange(len(gradient)), np.rad2deg(gradient), color="black")
axes.set(xlabel="design variable", ylabel="rotation per shift (deg/mm)")
