"""Clearance: the smallest gap between any two units along a load path, found by geometry."""

import numpy as np
from specimen import draw, panels, pressed, squares

import sim

lattice = squares(6, 6)
scene = pressed(lattice, shortening=10.0)
path = sim.simulate(scene, times=np.linspace(0.0, 1.0, 21))
found = sim.structure.clearance(lattice, lattice.vertices, path.displacement[0])
smallest = float(found.gap.min())  # mm
overlaps = int(found.overlaps.max())
void_angle = float(np.rad2deg(path.observables[0].void_angle[-1]))  # deg

figure, (left, right) = panels(2)
left.plot(10.0 * path.times, found.gap, color="black")
left.set(xlabel="shortening (mm)", ylabel="smallest gap (mm)", ylim=(0, None))
near = np.isin(np.arange(lattice.n_units), found.gap_units[-1]).astype(float)
draw(right, lattice, path.displacement[0, -1], near, cmap="Oranges", clim=(0, 1.5))
