"""Energy of an undamped motion: the explicit integrator keeps it while voids open and close."""

import numpy as np
from specimen import PLA, panels, squares

import sim

lattice = squares(6, 6)
edge = np.flatnonzero(lattice.index[:, 0] == 0)
kick = sim.Pulse(amplitude=4.0, width=0.01, delay=0.04)  # mm, s
scene = sim.Scene(
    sim.Structure(lattice, PLA._replace(damping_translation=0.0, damping_rotation=0.0)),
    sim.Loads((sim.PrescribedMotion(edge, kick),), duration=0.4, frequency=50.0),
    numerics=sim.Numerics(integrator="explicit"),
)
response = sim.simulate(scene, times=np.linspace(0.0, 0.4, 401))
seen = response.observables[0]
kinetic = 0.5 * (response.parameters.mass * response.velocity[0] ** 2).sum(axis=(1, 2))
total = kinetic + seen.strain_energy + seen.contact_energy  # N mm
free = response.times > 0.1  # the kick is over
drift = float(np.ptp(total[free]) / total[free].mean())

figure, axes = panels(1)
axes.plot(1e3 * response.times, total, color="black", label="total")
axes.plot(1e3 * response.times, seen.strain_energy, color="tab:purple", label="strain")
axes.set(xlabel="time (ms)", ylabel="energy (N mm)", title=f"drift {drift:.0e}")
axes.legend(frameon=False)
