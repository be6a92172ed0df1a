"""Shields the rim of a small lattice from a shaken unit, with sim/ alone."""

import numpy as np

from sim.constraints import ConstraintVector, Limits
from sim.optimise import SqpOptions, minimise
from sim.scene import Scene, evaluator, make_plan
from sim.solvers import Harmonic, held_dofs
from sim.structure import Material, damping_of_ratio, quads

lattice = quads(7, 7, spacing=15.0, ligament_length=2.25, bias_angle=np.deg2rad(20.0))  # mm
ring = np.abs(lattice.index - 3).max(axis=1)  # of each unit around the centre
density, shear, bending = 6.18e-9, 1.19, 1.5  # tonne/mm^2, N/mm, N mm/rad
damping = damping_of_ratio(0.0186, density, 15.0, shear, bending)
scene = Scene(
    lattice=lattice,
    material=Material(density, 120.0, shear, bending, 1.5, *damping),
    barrier=np.deg2rad(-15.0),
    cutoff=np.deg2rad(-10.0),
    clamped=held_dofs(np.array([0, 6, 42, 48]), np.array([], dtype=int)),
    driven=np.flatnonzero(ring == 0),
    motions=(Harmonic(amplitude=2.0, frequency=5.0, direction=np.deg2rad(45.0)),),
    weights=np.ones(1),
    duration=0.2,
    frequency=5.0,
    static=False,
    cloak=np.flatnonzero((ring == 1) | (ring == 2)),
    region=np.flatnonzero(ring == 3),
)
plan = make_plan(scene)
evaluate = evaluator(scene, plan)
loss, gradient, _ = evaluate(np.zeros(scene.space.n_variables))
limits = Limits(edge_length=5.0, block_angle=np.deg2rad(30.0), void_angle=0.0, gap=0.2)
best = minimise("sqp", evaluate, ConstraintVector(scene.space, limits), np.zeros_like(gradient),
                options=SqpOptions(evaluations=8))  # fmt: skip
print(plan.describe())
print(f"loss {loss:.4f}, |gradient| {np.linalg.norm(gradient):.4f} / mm -> loss {best.loss:.4f}")
