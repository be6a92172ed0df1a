"""Sums the force of a drive: what its units resist with, and what accelerates them."""

import numpy as np

from sim.core import Floats, Ints
from sim.energy import Observables
from sim.scene.scene import Scene
from sim.solvers import PrescribedMotion
from sim.structure import ConcreteParameters


def drive_force(
    scene: Scene,
    values: ConcreteParameters,
    seen: Observables,
    drive: PrescribedMotion,
    times: Floats,
    units: Ints | None = None,
) -> Floats:
    """Sums the forces (n_times, 2) on the units of a drive: held in place, and put on, N.

    In time they accelerate these units and overcome their damping as well. At kinks of the motion,
    such as a start with a velocity, the impulses are left out: of a `TimeSeries`, linear between
    its points, all inertia.

    Args:
        scene: the scene.
        values: parameters of the structure.
        seen: what was observed of the states.
        drive: the drive of their load case.
        times: (n_times,) of the states, s; load parameters of a static scene.
        units: (n,) the units meant; by default the drive's, of several motions together the first
            one's: those of a squeeze balance.
    """
    meant = drive.leading if units is None else units
    put_on = drive.forces(times)
    if not scene.loads.static:
        put_on = put_on + drive.resistance(values, times)
    own = np.isin(drive.units, meant)
    return np.asarray(seen.force_on(meant) + put_on[:, own, :2].sum(axis=1))
