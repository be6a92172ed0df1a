"""Imperfect copies: how the force scatters when every vertex is off by up to 0.3 mm."""

import numpy as np
from specimen import PLA, panels, pressed, squares

import sim

lattice = squares(6, 6)
scene = pressed(lattice, shortening=8.0)
times = np.linspace(0.0, 1.0, 9)
sizes = sim.structure.Perturbation(geometry=0.3)  # mm
forces = []
for number in range(12):
    copy = sim.structure.perturbed(
        lattice, lattice.vertices, PLA, sizes, scene.structure.contact, (0, number)
    )
    path = sim.simulate(scene, vertices=copy.vertices, times=times)
    forces.append(-path.drive_force[0, :, 1])
perfect = -sim.simulate(scene, times=times).drive_force[0, :, 1]
spread = float(np.std([force[-1] for force in forces]) / perfect[-1])

figure, axes = panels(1)
axes.plot(8.0 * times, np.transpose(forces), color="0.7", lw=0.6)
axes.plot(8.0 * times, perfect, color="black")
axes.set(xlabel="shortening (mm)", ylabel="force (N)", title=f"scatter {100 * spread:.1f} %")
