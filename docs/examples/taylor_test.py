"""Taylor test: the remainder of a linear prediction by the gradient falls as the step squared."""

import numpy as np
from specimen import panels, pressed, squares

import sim

lattice = squares(5, 5)
inner = ((lattice.index > 0) & (lattice.index < 4)).all(axis=1)
scene = pressed(lattice, shortening=6.0).updated(
    region=np.flatnonzero(inner), kind="strain_energy", steps=4, cloak=np.flatnonzero(inner)
)
loss, gradient = sim.evaluate(scene)
direction = np.random.default_rng(0).normal(size=len(gradient))
steps = 0.1 / 2.0 ** np.arange(6)  # mm
remainders = np.array(
    [abs(sim.evaluate(scene, h * direction)[0] - loss - h * gradient @ direction) for h in steps]
)
slope = float(np.polyfit(np.log(steps), np.log(remainders), 1)[0])

figure, axes = panels(1)
axes.loglog(steps, remainders, "o-", color="black")
axes.set(xlabel="step (mm)", ylabel="remainder (N mm)", title=f"slope {slope:.2f}")
