"""Finds where a path begins, and how it goes on where it ends: by damped motion to rest."""

import numpy as np

from sim.core import Floats, Ints, compiled, inlined
from sim.energy import System, Workspace, hessian_product, locate
from sim.quasistatics.increments import length, towards
from sim.quasistatics.newton import correct, factorise_shifted, factorise_tangent
from sim.quasistatics.snap import lowest_mode, push, relax

CRITICAL = 1e-3
"""Eigenvalue at the end of a path below which it is singular there, over the first state's."""
UNLOADED = 1e-7
"""Share of the load that acts on a critical mode up to which it does not: there the path branches,
elsewhere it turns back in a limit point."""
NOTICEABLE = 1e-2
"""Movement at the end of a path that is a jump, mm."""
BEYOND = 1e-3
"""Way of the held dofs by which a branching is passed, mm: nearer to it no state is stable enough
to be found."""
SWEEPS_AT_LOADS = 40
"""Inverse iterations for the eigenvalue of an output load at most."""
EIGENVALUE = 1e-6
"""Relative change that ends them."""
SMOOTH, LIMIT_POINT, BRANCHING = 0, 1, 2
"""Kinds of the way to a load."""


@inlined
def scatter(count: int) -> Floats:
    """Makes fixed numbers without symmetry, the estimate of a mode (count,)."""
    return np.sin(1.0 + np.arange(count))


@compiled
def leave(
    motion: Floats, load: Floats, ahead: float, mode: Floats, sense: float, first: float,
    drag: Floats, relative: float, absolute: float, system: System, work: Workspace, counts: Ints,
) -> tuple[float, int]:  # fmt: skip
    """Goes on from the end of a path by damped motion; returns the part of the way gone, and how.

    `motion`, at the end, is moved; `ahead` is the part of the way to `load` (n_held,) beyond it.
    `mode` (n_free,) is filled with the critical one, S v; a branching is left along it (`sense` 1)
    or against it (-1). `first` is the eigenvalue of the first state. Tolerances are those of
    `follow`. The workspace holds a factor of the tangent before and after. The part is negative if
    the structure came to no rest.

    Returns:
        the part of the way gone, negative if the structure came to no rest; and the kind of the
        path's end.
    """
    work.saved[:] = motion
    # of mirrored modes that are critical at once the mixture depends on the start of the iteration
    mode[:] = scatter(len(mode))
    value = lowest_mode(system, work, mode, SWEEPS_AT_LOADS, EIGENVALUE)
    towards(motion, load, 1.0, system, work)
    way = length(work.product, system.held, system)
    locate(motion, system, work.kinematics)
    hessian_product(motion, system, work.kinematics, work.product, work.force)
    along, force = 0.0, 0.0
    for i in range(len(mode)):
        d = system.dofs[i]
        along -= mode[i] * work.force[d] / system.scale[d]
        force += (work.force[d] / system.scale[d]) ** 2
    branches = abs(along) <= UNLOADED * np.sqrt(force)
    if branches:
        along = sense
        ahead = max(ahead, min(1.0, BEYOND / max(way, BEYOND)))
    for i in range(len(system.held)):
        d = system.held[i]
        motion[d] = load[i] if ahead == 1.0 else motion[d] + ahead * (load[i] - motion[d])
    push(motion, mode, np.sign(along), system, work)
    if not relax(motion, drag, relative, absolute, system, work, counts):
        return -1.0, LIMIT_POINT
    work.trial[:] = motion - work.saved
    if branches and abs(value) < CRITICAL * first:
        return ahead, BRANCHING
    jumped = length(work.trial, system.dofs, system) > NOTICEABLE
    return ahead, LIMIT_POINT if jumped else SMOOTH


@compiled
def come_to_rest(
    motion: Floats, mode: Floats, sense: float, drag: Floats, relative: float, absolute: float,
    system: System, work: Workspace, counts: Ints,
) -> tuple[float, int]:  # fmt: skip
    """Moves the unloaded structure to its equilibrium, as a void may start in contact.

    Returns:
        the smallest eigenvalue there, negative if there is none; and the kind of the way.
    """
    mode[:] = scatter(len(mode))
    end = SMOOTH
    if not correct(motion, relative, absolute, True, system, work, counts):
        return -1.0, end
    if not factorise_tangent(motion, system, work, 0.0, counts):
        factorise_shifted(motion, system, work, counts)
        share, end = leave(
            motion, motion[system.held], 0.0, mode, sense, np.inf, drag, relative, absolute,
            system, work, counts,
        )  # fmt: skip
        if share < 0.0:
            return -1.0, end
    return lowest_mode(system, work, mode, SWEEPS_AT_LOADS, EIGENVALUE), end
