"""Two laws of contact: on the void angle of a ligament, and on the distance of outlines."""

import numpy as np
from specimen import CLOAKED, INTACT, panels, pressed, squares

import sim

lattice = squares(6, 6)
laws = {
    "void angle": sim.VoidAngleContact(np.deg2rad(-15.0), np.deg2rad(-10.0)),
    "distance": sim.DistanceContact(0.5),  # mm
}
times = np.linspace(0.0, 1.0, 31)
forces, gaps = {}, {}
for name, law in laws.items():
    path = sim.simulate(pressed(lattice, 16.0, law), times=times)
    forces[name] = -path.drive_force[0, :, 1]
    gaps[name] = sim.structure.clearance(lattice, lattice.vertices, path.displacement[0]).gap

largest_by_angle, largest_by_distance = (forces[name][-1] for name in laws)
smallest_by_distance = float(gaps["distance"].min())

figure, (left, right) = panels(2)
for (name, force), colour in zip(forces.items(), (INTACT, CLOAKED)):
    left.plot(16.0 * times, force, color=colour, label=name)
    right.plot(16.0 * times, gaps[name], color=colour)
left.set(xlabel="shortening (mm)", ylabel="force (N)")
left.legend(frameon=False)
right.set(xlabel="shortening (mm)", ylabel="smallest gap (mm)")
