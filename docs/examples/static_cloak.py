"""A static cloak: units around a region keep strain out of it while the lattice is pressed."""

import numpy as np
from specimen import PLA, draw, panels, pressed, squares

import sim

lattice = squares(9, 9)
ring = np.abs(lattice.index - 4).max(axis=1)
scene = pressed(lattice, shortening=10.0).updated(
    region=np.flatnonzero(ring <= 1),
    kind="strain_energy",
    steps=5,
    cloak=np.flatnonzero((ring > 1) & (ring <= 3)),
)
limits = sim.Limits(edge_length=5.0, block_angle=np.deg2rad(30.0), void_angle=0.0, gap=0.2)
best = sim.minimise(scene, limits, options=sim.SqpOptions(evaluations=6))

before, _ = sim.evaluate(scene)  # N mm
after = best.loss
shear_stiffness = PLA.shear_stiffness

figure, axes = panels(2)
for panel, design, loss in zip(axes, (None, best.x), (before, after)):
    path = sim.simulate(scene, design)
    shape = None if design is None else scene.space.vertices(design)
    colours = np.where(ring <= 1, 1.0, 0.0)
    draw(panel, lattice, path.displacement[0, -1], colours, shape, cmap="Purples", clim=(0, 2))
    panel.set_title(f"energy of the region {loss:.2f} N mm")
