"""Searches vertices and edges within the reach of contact."""

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
    """Counts the pairs of units nearer than the activation distance in a state (n_dofs,)."""
