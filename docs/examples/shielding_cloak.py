"""A dynamic cloak: two rings around a shaken unit are redesigned until the rim stays at rest."""

import numpy as np
from specimen import ALTERED, CLOAKED, PLA, draw, panels, squares

import sim

lattice = squares(7, 7)
ring = np.abs(lattice.index - 3).max(axis=1)  # of each unit around the centre
shaking = sim.Harmonic(amplitude=2.0, frequency=5.0, direction=np.deg2rad(45.0))
scene = sim.Scene(
    sim.Structure(lattice, PLA),
    sim.Loads(
        cases=(sim.PrescribedMotion(np.flatnonzero(ring == 0), shaking),),
        supports=(sim.Clamp(np.array([0, 6, 42, 48])),),
        duration=0.2,
    ),
    sim.Objective(region=np.flatnonzero(ring == 3)),
    sim.Design(cloak=np.flatnonzero((ring == 1) | (ring == 2))),
)
limits = sim.Limits(edge_length=5.0, block_angle=np.deg2rad(30.0), void_angle=0.0, gap=0.2)
best = sim.minimise(scene, limits, options=sim.SqpOptions(evaluations=8))

before = float(sim.simulate(scene).loss)
after = best.loss
evaluations = len(best.evaluations)

figure, axes = panels(2)
vertices = scene.space.vertices(best.x)
for panel, shape, loss, colour in zip(axes, (None, vertices), (before, after), (ALTERED, CLOAKED)):
    draw(panel, lattice, vertices=shape, edgecolor=colour)
    panel.set_title(f"loss {loss:.3f}")
