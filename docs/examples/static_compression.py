"""Static compression: the force of a lattice of rotating squares over its shortening."""

import numpy as np
from specimen import draw, panels, pressed, squares

import sim

lattice = squares(8, 8)
scene = pressed(lattice, shortening=10.0)  # mm
path = sim.simulate(scene, times=np.linspace(0.0, 1.0, 41))

shortening = 10.0 * path.times
force = -path.drive_force[0, :, 1]  # N
stiffness = force[1] / shortening[1]  # N/mm
plateau = force.max()
contacts = int(path.observables[0].contact_pairs[-1])

figure, (left, right) = panels(2)
left.plot(shortening, force, color="black")
left.set(xlabel="shortening (mm)", ylabel="force (N)")
draw(right, lattice, path.displacement[0, -1])
right.set_title(f"{shortening[-1]:.0f} mm, {contacts} pairs in contact")
