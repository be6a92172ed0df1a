"""A symmetric design: one orbit of vertices a variable, so that four directions become one."""

import numpy as np
from specimen import PLA, draw, panels, squares

import sim

lattice = squares(7, 7)
ring = np.abs(lattice.index - 3).max(axis=1)
centre = np.flatnonzero(ring == 0)
directions = np.deg2rad([0.0, 90.0])
scene = sim.Scene(
    sim.Structure(lattice, PLA),
    sim.Loads(
        tuple(sim.PrescribedMotion(centre, sim.Harmonic(2.0, 5.0, angle)) for angle in directions),
        duration=0.2,
    ),
    sim.Objective(region=np.flatnonzero(ring == 3)),
    sim.Design(cloak=np.flatnonzero((ring == 1) | (ring == 2)), symmetry="C4"),
)
free = scene.updated(symmetry="none")
variables, without = scene.space.n_variables, free.space.n_variables
random = np.random.default_rng(0).uniform(-1.0, 1.0, variables)
losses = np.asarray(sim.simulate(scene, random).losses)
difference = float(np.ptp(losses) / losses.mean())

figure, axes = panels(1)
draw(axes, lattice, vertices=scene.space.vertices(random), edgecolor="tab:purple")
axes.set_title(f"{variables} variables for {without}")
