"""A hidden void: the surroundings of a hole move as if nothing had been cut out."""

import numpy as np
from specimen import ALTERED, CLOAKED, draw, panels, pressed, squares

import sim

whole = squares(9, 9)
ring = np.abs(whole.index - 4).max(axis=1)
hole = whole.id[ring == 0]
lattice = whole.without(hole)
kept = np.setdiff1d(np.arange(whole.n_units), hole)
outside = np.flatnonzero(ring[kept] > 2)
reference = pressed(whole, shortening=8.0).updated(region=kept[outside], steps=5)
scene = pressed(lattice, shortening=8.0).updated(
    region=outside, steps=5, reference=reference, cloak=np.flatnonzero(ring[kept] <= 2)
)
limits = sim.Limits(edge_length=5.0, block_angle=np.deg2rad(30.0), void_angle=0.0, gap=0.2)
best = sim.minimise(scene, limits, options=sim.SqpOptions(evaluations=6))

before, _ = sim.evaluate(scene)
after = best.loss

figure, axes = panels(2)
for panel, design, loss, colour in zip(axes, (None, best.x), (before, after), (ALTERED, CLOAKED)):
    path = sim.simulate(scene, design)
    shape = None if design is None else scene.space.vertices(design)
    draw(panel, lattice, path.displacement[0, -1], vertices=shape, edgecolor=colour)
    panel.set_title(f"loss {100 * loss:.2f} %")
