"""Shields the rim of a small lattice from a shaken unit, with sim/ alone."""

import numpy as np

import sim

lattice = sim.quads(7, 7, spacing=15.0, ligament_length=2.25, bias_angle=np.deg2rad(20.0))  # mm
ring = np.abs(lattice.index - 3).max(axis=1)  # of each unit around the centre
density, shear, bending = 6.18e-9, 1.19, 1.5  # tonne/mm^2, N/mm, N mm/rad
damping = sim.damping_of_ratio(0.0186, density, 15.0, shear, bending)
shaken = sim.Harmonic(amplitude=2.0, frequency=5.0, direction=np.deg2rad(45.0))  # mm, Hz, rad
scene = sim.Scene(
    sim.Structure(lattice, sim.Material(density, 120.0, shear, bending, 1.5, *damping)),
    sim.Loads(
        cases=(sim.PrescribedMotion(np.flatnonzero(ring == 0), shaken),),
        supports=(sim.Clamp(np.array([0, 6, 42, 48])),),
        duration=0.2,  # s
    ),
    sim.Objective(region=np.flatnonzero(ring == 3)),
    sim.Design(cloak=np.flatnonzero((ring == 1) | (ring == 2))),
)
response = sim.simulate(scene)
print(response.plan.describe())
print(f"largest force of the drive {np.abs(response.drive_force).max():.3f} N")

loss, gradient = sim.evaluate(scene)
limits = sim.Limits(edge_length=5.0, block_angle=np.deg2rad(30.0), void_angle=0.0, gap=0.2)
best = sim.minimise(scene, limits, options=sim.SqpOptions(evaluations=8))
print(f"loss {loss:.4f}, |gradient| {np.linalg.norm(gradient):.4f} / mm -> loss {best.loss:.4f}")
