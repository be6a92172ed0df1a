"""A wave: one edge is shaken at 30 Hz, and rotations run into the lattice."""

import numpy as np
from specimen import PLA, draw, panels, squares

import sim

lattice = squares(16, 8)
left_edge = np.flatnonzero(lattice.index[:, 0] == 0)
shaking = sim.Harmonic(amplitude=1.0, frequency=30.0)  # mm, Hz, along x
scene = sim.Scene(
    sim.Structure(lattice, PLA),
    sim.Loads((sim.PrescribedMotion(left_edge, shaking),), duration=0.1),
)
wave = sim.simulate(scene, times=np.linspace(0.0, 0.1, 51))

integrator = type(wave.plan.solver).__name__
front = np.abs(wave.displacement[0, :, :, 0]).max(axis=0)  # mm, of each unit
arrived = int((front > 0.1).sum())

figure, axes = panels(1, width=5.0)
turn = np.rad2deg(wave.displacement[0, -1, :, 2])
units = draw(axes, lattice, wave.displacement[0, -1], turn, cmap="RdBu_r", clim=(-8, 8))
figure.colorbar(units, label="rotation (deg)")
axes.set_title(f"{1e3 * wave.times[-1]:.0f} ms")
