"""An error estimate: the same motion with half the steps, for three settings of accuracy."""

import numpy as np
from specimen import PLA, panels, squares

import sim

lattice = squares(7, 7)
ring = np.abs(lattice.index - 3).max(axis=1)
shaking = sim.Harmonic(amplitude=3.0, frequency=2.0)
scene = sim.Scene(
    sim.Structure(lattice, PLA),
    sim.Loads((sim.PrescribedMotion(np.flatnonzero(ring == 0), shaking),), duration=0.5),
    sim.Objective(region=np.flatnonzero(ring == 3)),
)
errors = {}
for accuracy in ("draft", "default", "tight"):
    response = sim.simulate(scene.updated(accuracy=accuracy))
    finer = response.refined()
    change = response.displacement - finer.displacement
    errors[accuracy] = float(np.linalg.norm(change) / np.linalg.norm(finer.displacement))
draft, default, tight = errors.values()

figure, axes = panels(1)
axes.semilogy(list(errors), list(errors.values()), "o-", color="black")
axes.set(xlabel="accuracy", ylabel="relative change\nat half the steps")
