"""A measured drive: units follow a time series, here one that a camera might have recorded."""

import numpy as np
from specimen import PLA, panels, squares

import sim

lattice = squares(7, 7)
middle = np.flatnonzero((lattice.index == 3).all(axis=1))
random = np.random.default_rng(1)
recorded = np.linspace(0.0, 0.5, 126)  # s: 250 frames a second
swing = 2.0 * np.sin(2 * np.pi * 4.0 * recorded) * (1 - np.exp(-recorded / 0.05))
noise = random.normal(scale=0.01, size=len(recorded))  # mm
motion = np.stack([swing + noise, 0.2 * swing, np.zeros_like(swing)], axis=1)
scene = sim.Scene(
    sim.Structure(lattice, PLA),
    sim.Loads(
        cases=(sim.PrescribedMotion(middle, sim.TimeSeries(recorded, motion)),),
        supports=(sim.Clamp(np.flatnonzero(np.abs(lattice.index - 3).max(axis=1) == 3)),),
        duration=0.5,
        frequency=4.0,
    ),
)
response = sim.simulate(scene, times=np.linspace(0.0, 0.5, 101))
beside = response.displacement[0, :, middle[0] + 1, 0]  # mm
largest = float(np.abs(beside).max())

figure, axes = panels(1)
axes.plot(1e3 * recorded, motion[:, 0], color="0.6", label="drive")
axes.plot(1e3 * response.times, beside, color="black", label="next unit")
axes.set(xlabel="time (ms)", ylabel="displacement (mm)")
axes.legend(frameon=False)
