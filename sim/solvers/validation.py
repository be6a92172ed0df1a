"""Checks solver inputs: finite parameters, units that hang together, no initial overlap.

Beyond its barrier a void has no force, and a unit without mass no acceleration: a solver would go
on from there without a sign that anything is wrong.
"""

from typing import Any

import jax
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from sim.collision import ContactArrays, contact_arrays, find, raise_new_pairs
from sim.core import Floats, SimulationError
from sim.energy import Topology
from sim.solvers.loads import MotionLaw
from sim.structure import ConcreteParameters, VoidAngleContact

NEVER_NEGATIVE = {
    "law": "stiffness of the ligaments",
    "contact": "stiffness of contact",
    "damping": "damping",
}
COLLAPSED = 1e-3
"""Length of a ligament in motion, over that at rest, below which it has none."""


def check_parameters(values: ConcreteParameters, motion: MotionLaw) -> None:
    """Raises an error that names what is not finite, or negative where that has no meaning."""
    parts: dict[str, Any] = {
        f"{name} of the structure": part for name, part in values._asdict().items()
    }
    parts["motion of the driven units"] = jax.tree.leaves(motion)
    for name, part in parts.items():
        if not all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(part)):
            raise SimulationError(
                f"the {name} is not everywhere a finite number; try another design (no unit without"
                " area, no edge without length) or mend the series that drives it"
            )
    for field, name in NEVER_NEGATIVE.items():
        part = getattr(values, field)
        if part.min(initial=0.0) < 0.0:
            raise SimulationError(
                f"the {name} is negative in one place ({part.min():.3g}); make it zero or more"
            )


def check_free_dofs(topology: Topology) -> None:
    """Raises an error if nothing can move, or no two units are joined."""
    if topology.n_free == 0:
        raise SimulationError(
            "every unit is held, so nothing is left to solve for; hold fewer units"
        )
    if len(topology.ligament_units) == 0:
        raise SimulationError("no two units are joined; try a structure that has ligaments")


def check_connected(topology: Topology) -> None:
    """Raises an error that names a unit which hangs on nothing: it has no equilibrium."""
    one, other = topology.ligament_units.T
    joined = coo_array((np.ones(len(one)), (one, other)), shape=(topology.n_units,) * 2)
    _, piece = connected_components(joined, directed=False)
    floating = np.flatnonzero(~np.isin(piece, piece[topology.unloaded.held // 3]))
    if len(floating) > 0:
        raise SimulationError(
            f"unit {floating[0]} ({len(floating)} units in all) is joined to no unit that is held,"
            " so it has no equilibrium; hold it, or try the structure without it",
            unit=int(floating[0]),
        )


def check_masses(values: ConcreteParameters, *, at_rest: bool = False) -> None:
    """Raises an error that names a unit which nothing accelerates, or the wrong way round.

    Where inertia plays no part, ``at_rest``, a unit may be without mass, but not turned inside out.
    """
    lightest = values.mass.min(axis=1)
    if (lightest < 0.0).any() or (not at_rest and (lightest == 0.0).any()):
        unit = int(lightest.argmin())
        raise SimulationError(
            f"unit {unit} has no mass, or less than none ({lightest[unit]:.3g}); try another design"
            " (corners counter-clockwise, no unit without area) or a density above zero",
            unit=unit,
        )


def check_start(
    topology: Topology, values: ConcreteParameters, contacts: ContactArrays, start: Floats
) -> None:
    """Raises an error that names two units which are in one another in a state (n_dofs,)."""
    if len(contacts.pairs) > 0 and find(start, contacts) < 0:
        raise_new_pairs(contacts)
        raise SimulationError(
            f"units {contacts.cache.overlap[0]} and {contacts.cache.overlap[1]} overlap at"
            f" {_moment(start)}; ask for a gap between units, or take contact: angle"
        )
    law = topology.contact
    if isinstance(law, VoidAngleContact) and len(values.void) > 0:
        angles = topology.smallest_void_angles(values.void, start.reshape(-1, 3))
        if angles.min() <= law.barrier_angle:
            one, other = topology.ligament_units[angles.argmin()]
            raise SimulationError(
                f"the void between units {one} and {other} is closed to"
                f" {np.rad2deg(angles.min()):.4g} deg at {_moment(start)}, its barrier is at"
                f" {np.rad2deg(law.barrier_angle):.4g} deg; ask for a larger smallest void angle,"
                " or try a drive that starts from rest",
                unit=int(one),
            )


def check_ligaments(topology: Topology, values: ConcreteParameters, states: Floats) -> None:
    """Raises an error that names a ligament without length in some of the states (n, n_dofs).

    Its energy has a tip there: forces vanish in a state that is far from balance.
    """
    x, y, turn = states.reshape(len(states), states.shape[1] // 3, 3).transpose(2, 0, 1)
    c, s = np.cos(turn), np.sin(turn)
    squares: Floats = np.zeros((len(states), len(values.vector)))
    for axis, (along, sign) in enumerate(((x, -1.0), (y, 1.0))):
        # the end moves by u + (R - 1) a, with the rows (c, -s) and (s, c) of R
        ends = [
            along[:, unit]
            + (c[:, unit] - 1.0) * arm[:, axis]
            + sign * s[:, unit] * arm[:, 1 - axis]
            for unit, arm in zip(
                topology.ligament_units.T, values.arm.transpose(1, 0, 2), strict=True
            )
        ]
        squares += (values.vector[:, axis] + ends[1] - ends[0]) ** 2
    share = np.sqrt(squares) / np.linalg.norm(values.vector, axis=1)
    if share.min(initial=np.inf) < COLLAPSED:
        state, ligament = np.unravel_index(share.argmin(), share.shape)
        a, b = topology.ligament_units[ligament]
        raise SimulationError(
            f"the ligament between units {a} and {b} has no length left in state {state}, where its"
            " law has no meaning; try more load steps or a smaller drive",
            step=int(state),
            unit=int(a),
        )


def inadmissible(
    topology: Topology, values: ConcreteParameters, states: Floats
) -> NDArray[np.bool_]:
    """Finds the states (n_states, n_dofs) with a void beyond its barrier, or an overlap."""
    law = topology.contact
    if isinstance(law, VoidAngleContact):
        motion = states.reshape(len(states), -1, 3)
        return topology.smallest_void_angle(values.void, motion) <= law.barrier_angle
    contacts = contact_arrays(law, values, topology.n_dofs // 3)
    found = np.array([find(state, contacts) < 0 for state in states], dtype=bool)
    raise_new_pairs(contacts)
    return found


def _moment(start: Floats) -> str:
    return "the start of the drive" if start.any() else "rest"
