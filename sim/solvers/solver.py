"""Defines the interface of a solver of one load case.

There are ``StaticSolver`` (equilibria), ``ImplicitSolver`` (slow drives) and ``ExplicitSolver``
(waves, tight tolerances).
"""

from __future__ import annotations

from typing import Any, Protocol

from sim.core import Floats, Ints
from sim.energy import Topology
from sim.solvers.prescribed_motion import PrescribedMotion
from sim.structure import ConcreteParameters


class Solver(Protocol):
    """Integrates one case in time, forward and back."""

    @property
    def topology(self) -> Topology:
        """The structure."""
        ...

    @property
    def output_times(self) -> Floats:
        """Times (n_times,) of the output, s."""
        ...

    @property
    def threads(self) -> int:
        """Cores to use: cases go side by side, and one alone shares a large tangent among them."""
        ...

    def refined(self, record: Any) -> Solver:
        """Returns one with half the steps that a record was made with, to estimate its error by."""
        ...

    def coupling(self, pairs: Ints) -> Solver:
        """Returns one with room in the tangent for contact of more pairs (n, 2) of units."""
        ...

    def forward(
        self, values: ConcreteParameters, drive: PrescribedMotion
    ) -> tuple[Floats, Floats, Any]:
        """Computes displacement and velocity (n_times, n_dofs), and what ``backward`` needs.

        The held dofs' own entries are of no account: they follow from the drive.

        Raises:
            SimulationError: a step failed.
            NewContactPairs: units met whose coupling the tangent has no room for.
        """
        ...

    def backward(
        self, values: ConcreteParameters, record: Any, bar_u: Floats, bar_v: Floats
    ) -> tuple[ConcreteParameters, Floats, Floats]:
        """Loss derivatives by the parameters, and by the drive at the times also returned.

        Raises:
            NewContactPairs: units are near whose coupling the record's topology has no room for.
        """
        ...
