"""Transmission: how much of a small vibration arrives at the other side, over its frequency."""

import numpy as np
from specimen import PLA, panels, squares

import sim

lattice = squares(10, 6)
left_edge, right_edge = (np.flatnonzero(lattice.index[:, 0] == column) for column in (0, 9))
scene = sim.Scene(
    sim.Structure(lattice, PLA),
    sim.Loads((sim.PrescribedMotion(left_edge, sim.Harmonic(1.0, 1.0)),)),
)
values = sim.scene.concrete_parameters(scene, lattice.vertices)
linear = sim.vibration.linearised(scene.topology, values)
frequency = np.linspace(1.0, 150.0, 150)  # Hz
shaken = np.tile([1.0, 0.0, 0.0], len(left_edge))[:, None]  # along x
motion = sim.vibration.transmission(linear, shaken, 2 * np.pi * frequency)
arriving = np.abs(motion[:, 0, right_edge, 0]).mean(axis=1)
largest = float(arriving.max())
at_100_hz = float(np.interp(100.0, frequency, arriving))

figure, axes = panels(1)
axes.semilogy(frequency, arriving, color="black")
axes.set(xlabel="frequency (Hz)", ylabel="motion at the far edge / drive")
