"""Names how the way to a load may go on, as ``path_ends.c`` finds it."""

SMOOTH, LIMIT_POINT, BRANCHING = 0, 1, 2
"""Kinds of the way to a load."""
