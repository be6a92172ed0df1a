"""A void from a picture: the units under its shape are cut out of the lattice."""

from pathlib import Path

import numpy as np
from specimen import draw, panels, pressed, squares

import sim
from pipeline.problem.outlines import find_inside, read_outlines

picture = Path(__file__).resolve().parents[2] / "experiments/shapes/cat.png"
outlines = read_outlines(picture)
corners = np.concatenate(outlines)
middle, size = (corners.max(axis=0) + corners.min(axis=0)) / 2, np.ptp(corners, axis=0).max()
whole = squares(20, 20)
centre, width = whole.site.mean(axis=0), 170.0  # mm
placed = tuple((np.asarray(each) - middle) / size * width + centre for each in outlines)
cut = np.flatnonzero(find_inside(whole.site, placed, hair=1e-9))
lattice = whole.without(whole.id[cut])
path = sim.simulate(pressed(lattice, shortening=10.0), times=np.linspace(0.0, 1.0, 6))
n_cut = len(cut)
force = float(-path.drive_force[0, -1, 1])  # N

figure, axes = panels(1, width=3.4, height=3.2)
draw(axes, lattice, path.displacement[0, -1])
for outline in placed:
    axes.plot(*np.vstack([outline, outline[:1]]).T, color="tab:orange", lw=1)
