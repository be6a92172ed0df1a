"""Places the outlines of units in a state: how near two come, and whether they cross."""

from typing import NamedTuple

from sim.core import Floats, Ints


class NeighbourCache(NamedTuple):
    """Caches the last state looked at; overwritten at will."""

    state: Floats  # (n_dofs,) that state
    place: Floats  # (n_vertices, 2) its vertices, mm
    centre: Floats  # (n_units, 2) its centroids, mm
    searched: Floats  # (n_dofs,) the state of the last sweep
    moved: Floats  # (n_units,) bound of the motion of each unit's points since then, mm
    gap: Floats  # (n_pairs,) distance of the pairs then, or a lower bound of it, mm
    room: Floats  # (1,) smallest distance of a new pair then, or a lower bound of it, mm
    new_pairs: Ints  # (MAX_NEW_PAIRS, 2) units of pairs that the tangent has no room for
    terms: Ints  # (n, 3) vertex, and the start and end of an edge; the end is -1 for a vertex alone
    found: Ints  # (2,) number of terms, -1 if the state is not admissible, and number of new pairs
    overlap: Ints  # (2,) units that overlap, if the state is not admissible


class ContactArrays(NamedTuple):
    """Holds units that may meet, as the kernels take them; without pairs there is no contact."""

    pairs: Ints  # (n_pairs, 2) units, ascending, whose coupling the tangent has room for
    first: Ints  # (n_units + 1,) start of each polygon in the vertices
    owner: Ints  # (n_vertices,) unit of each vertex
    following: Ints  # (n_vertices,) its counter-clockwise neighbour
    corner: Floats  # (n_vertices, 2) arm at rest, mm
    centroid: Floats  # (n_units, 2) at rest, mm
    radius: Floats  # (n_units,) longest arm, mm
    energy: float  # scale of the barrier, N mm
    per_stiffness: float  # its derivative by the contact stiffness of a single ligament, rad^2
    distance: float  # activation distance, mm
    reach: float  # distance up to which the sweep finds pairs, mm
    margin: float  # motion of a unit after which it is repeated, mm
    cache: NeighbourCache  # scratch
