"""Vibration modes: the slowest ones of a lattice that is clamped at the bottom."""

from specimen import PLA, draw, panels, rows_of, squares

import sim

lattice = squares(8, 8)
scene = sim.Scene(
    sim.Structure(lattice, PLA), sim.Loads((), supports=(sim.Clamp(rows_of(lattice, 0)),))
)
values = sim.scene.concrete_parameters(scene, lattice.vertices)
found = sim.vibration.modes(sim.vibration.linearised(scene.topology, values), count=3)
first, second, third = found.frequency  # Hz

figure, axes = panels(3, width=2.2)
for panel, shape, frequency in zip(axes, found.shape, found.frequency):
    scale = 8.0 / abs(shape[:, :2]).max()
    draw(panel, lattice, scale * shape)
    panel.set_title(f"{frequency:.2f} Hz")
