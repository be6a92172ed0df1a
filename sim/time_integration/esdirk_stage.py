"""Names how a stage of an implicit step may end, as ``esdirk_stage.c`` solves it."""

CONVERGED, STALLED, INDEFINITE = 0, 1, 2
"""Ends of a stage."""
