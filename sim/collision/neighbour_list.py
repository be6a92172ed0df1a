"""Searches vertices and edges within the reach of contact: compiled, conservative.

The broad phase sweeps all units and notes the gap of each pair of them that may meet. The gap of a
pair shrinks by no more than its units have moved since, so most pairs are skipped without a look at
their vertices; once any unit has moved by ``margin``, the sweep is repeated. Pairs whose coupling
the tangent has no room for ("new pairs") are noted before they come within reach: the state then
counts as not admissible, and the solve goes on, or is repeated, with more room.
"""

from sim.collision.polygons import ContactArrays
from sim.core import Floats, compiled

MAX_NEW_PAIRS = 256
TERMS_PER_VERTEX = 16


@compiled
def find(motion: Floats, contacts: ContactArrays) -> int:
    """Lists the vertices and edges in contact in a state (n_dofs,) in ``cache.terms``.

    Returns:
        their number, or -1 if units overlap or a new pair comes close.
    """


@compiled
def pairs_in_contact(motion: Floats, contacts: ContactArrays) -> int:
    """Number of pairs of units nearer than the activation distance in a state (n_dofs,)."""
