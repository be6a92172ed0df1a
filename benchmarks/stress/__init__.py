"""Attempts to break the numbers: cases at the edge of what solvers stand, each judged by itself."""
