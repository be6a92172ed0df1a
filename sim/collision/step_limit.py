"""Limits a step so that no units pass through each other: compiled, by safe advances.

Two outlines that do not cross can only come to cross where a vertex of one meets an edge of the
other. In the frame of the edge's unit the vertex moves on a smooth curve, whose curvature is
bounded; as long as it stays on the far side of one of the lines that bound the edge's neighbourhood
(the edge's own, and its normals at both ends) it does not meet the edge. The step is advanced as
far as that bound vouches for, again and again, until a meeting is close or the step's end reached.
"""

from sim.collision.polygons import ContactArrays
from sim.core import Floats, compiled

FAR = 1.2
"""Multiples of a step that are looked at: somewhat more than solvers keep of the limit."""
CLOSE = 0.02
"""A meeting is close once an advance adds less than this to the multiple reached."""
MAX_ADVANCES = 200


@compiled
def collision_free_step(motion: Floats, contacts: ContactArrays, step: Floats) -> float:
    """Multiple of ``step`` (n_dofs,) up to which no two units meet; inf if beyond FAR."""
