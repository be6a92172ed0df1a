"""A kagome lattice: triangles in shear, and the strain of their ligaments."""

import numpy as np
from specimen import PLA, draw, panels

import sim

lattice = sim.kagome(7, 6, spacing=20.0, ligament_length=2.0, bias=2.0)
row = lattice.index[:, 1]
shear = sim.LinearRamp(amplitude=12.0, duration=1.0, direction=0.0)
scene = sim.Scene(
    sim.Structure(lattice, PLA),
    sim.Loads(
        (sim.PrescribedMotion(np.flatnonzero(row == row.max()), shear),),
        (sim.Clamp(np.flatnonzero(row == row.min())),),
        static=True,
    ),
)
path = sim.simulate(scene, times=np.linspace(0.0, 1.0, 21))
force = float(path.drive_force[0, -1, 0])  # N
largest_bend = float(np.rad2deg(path.observables[0].bend[-1]))  # deg

figure, axes = panels(1, width=4.5)
turn = np.rad2deg(path.displacement[0, -1, :, 2])
units = draw(axes, lattice, path.displacement[0, -1], turn, cmap="RdBu_r", clim=(-30, 30))
figure.colorbar(units, label="rotation (deg)")
