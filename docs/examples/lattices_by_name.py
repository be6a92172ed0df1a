"""Lattices by name: a honeycomb of triangles and a triangular lattice of hexagons, compressed."""

import numpy as np
from specimen import draw, panels, pressed

import sim

lattices = {
    "honeycomb": sim.honeycomb(11, 7, 15.0, ligament_length=2.25, bias_angle=np.deg2rad(15.0)),
    "triangular": sim.triangular(9, 11, 15.0, ligament_length=2.25),
}
figure, axes = panels(2)
stiffness = {}
for ax, (name, lattice) in zip(axes, lattices.items(), strict=True):
    shortening = 0.04 * np.ptp(lattice.site[:, 1])  # mm
    path = sim.simulate(pressed(lattice, shortening), times=np.array([0.1, 0.5, 1.0]))
    stiffness[name] = -float(path.drive_force[0, 0, 1]) / (0.1 * shortening)  # N/mm, at first
    turn = np.rad2deg(path.displacement[0, -1, :, 2])
    units = draw(ax, lattice, path.displacement[0, -1], turn, cmap="RdBu_r", clim=(-15, 15))
    ax.set_title(f"{name}, {stiffness[name]:.3g} N/mm", fontsize="medium")
figure.colorbar(units, ax=axes, label="rotation (deg)")
honeycomb, triangular = stiffness.values()
