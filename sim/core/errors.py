"""Defines the errors that a solve may end with; each says where it failed and what to try."""

from sim.core.arrays import Floats, Ints


class SimulationError(RuntimeError):
    """Reports that a solve could not reach its tolerance.

    Args:
        reason: what failed, where (step, worst unit) and what to try, in one sentence.
        step: index of the failed time or load step, or None.
        unit: id of the unit with the largest residual, or None.
        states: (n_reached, n_dofs) what was computed before, or None.
    """

    def __init__(
        self,
        reason: str,
        step: int | None = None,
        unit: int | None = None,
        states: Floats | None = None,
    ) -> None:
        super().__init__(reason)
        self.step = step
        self.unit = unit
        self.states = states


class NewContactPairs(SimulationError):  # noqa: N818  (a turn that a solve takes, no fault)
    """Reports pairs (n, 2) of units near each other whose coupling the tangent has no room for."""

    def __init__(self, pairs: Ints) -> None:
        super().__init__(f"units {pairs[0, 0]} and {pairs[0, 1]} meet; solve again with them")
        self.pairs = pairs
