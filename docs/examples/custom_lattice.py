"""A lattice of one's own: units as lists of corners, ligaments as pairs of end points."""

import numpy as np
from specimen import PLA, draw, panels

import sim

width, gap, columns, rows = 12.0, 3.0, 6, 4  # mm
step = width + gap
polygons, ligaments = [], []
for j in range(rows):
    for i in range(columns):
        x, y = i * step + (j % 2) * step / 2, j * step  # bricks: every other row is shifted
        polygons.append([(x, y), (x + width, y), (x + width, y + width), (x, y + width)])
        if i + 1 < columns:
            ligaments.append(((x + width, y), (x + step, y)))
        if j + 1 < rows and not (j % 2 and i + 1 == columns):
            above = (i + j % 2) * step + ((j + 1) % 2) * step / 2
            ligaments.append(((x + width, y + width), (above, y + step)))
lattice = sim.structure.listed(polygons, ligaments, spacing=step)
height = lattice.site[:, 1]
pull = sim.LinearRamp(amplitude=4.0, duration=1.0, direction=np.pi / 2)
scene = sim.Scene(
    sim.Structure(lattice, PLA),
    sim.Loads(
        (sim.PrescribedMotion(np.flatnonzero(height > height.max() - 1.0), pull),),
        (sim.Clamp(np.flatnonzero(height < height.min() + 1.0)),),
        static=True,
    ),
)
path = sim.simulate(scene, times=np.linspace(0.0, 1.0, 11))
force = float(path.drive_force[0, -1, 1])  # N
n_units, n_ligaments = lattice.n_units, lattice.n_ligaments

figure, axes = panels(1)
draw(axes, lattice, path.displacement[0, -1])
axes.set_title(f"{n_units} bricks, {force:.2f} N")
