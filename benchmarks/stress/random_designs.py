"""Draws designs at random, all of which keep to what can be made."""

from functools import cached_property

import numpy as np

from sim.constraints import ConstraintVector, Limits
from sim.core import Floats, Ints
from sim.structure import Lattice, design_space

LIMITS = Limits(
    edge_length=3.0, block_angle=float(np.deg2rad(30.0)), convex=True, void_angle=0.0, gap=0.2
)
"""The loosest that a study of the paper has."""
MOST_CUTS = 2000


class RandomDesigns:
    """Draws shifts of all vertices of a lattice, cut back place by place until they can be made.

    The `frozen` units stay; `largest` is the shift along x and y drawn at first, mm; `keep` the
    share that a vertex keeps in each cut: near 1 the design ends at the bounds.
    """

    def __init__(self, lattice: Lattice, frozen: Ints, largest: float, keep: float) -> None:
        space = design_space(lattice, np.arange(lattice.n_units), frozen)
        self._constraints = ConstraintVector(space, LIMITS)
        self._largest = largest
        self._keep = keep

    @cached_property
    def _variables(self) -> tuple[Ints, Ints]:
        size = self._constraints.space.n_variables
        pattern = self._constraints(np.zeros(size))[1].tocoo()
        row, variable = pattern.coords
        return row, variable

    def __call__(self, seed: int) -> Floats:
        """Draws the vertices (n_vertices, 2) of one design, mm."""
        random = np.random.default_rng(seed)
        largest = self._largest
        design = random.uniform(-largest, largest, self._constraints.space.n_variables)
        row, variable = self._variables
        for _ in range(MOST_CUTS):
            broken = self._constraints.values(design) < 0.0
            if not broken.any():
                return self._constraints.vertices(design)
            design[np.unique(variable[broken[row]])] *= self._keep
        raise ValueError(f"no design that can be made was found from seed {seed}")

    def at_bounds(self, vertices: Floats) -> float:
        """Returns the smallest margin of a design, mm (angles times a length)."""
        lattice = self._constraints.space.lattice
        shifts = np.zeros((lattice.n_groups, 2))
        shifts[lattice.group] = vertices - lattice.vertices
        return float(self._constraints.values(self._constraints.space.project(shifts)).min())
