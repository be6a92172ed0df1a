"""The families of the stress suite, in the order of its table."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.stress.families import (
    agreement,
    balances,
    barrier,
    branches,
    constants,
    designs,
    inputs,
    pieces,
    sizes,
    slender,
    symmetry,
    times,
    windings,
)
from benchmarks.stress.verdicts import StressFamily

FAMILIES = tuple(
    made.family()
    for made in (
        barrier,
        designs,
        slender,
        constants,
        times,
        windings,
        sizes,
        pieces,
        inputs,
        branches,
        balances,
        symmetry,
        agreement,
    )
)
NAMES = tuple(family.name for family in FAMILIES)


def load(asked: Sequence[str]) -> list[StressFamily]:
    """The families asked for; all without a name.

    Raises:
        ValueError: there is no such family.
    """
    unknown = sorted(set(asked) - set(NAMES))
    if unknown:
        raise ValueError(f"no family {', '.join(unknown)}; there are {', '.join(NAMES)}")
    return [family for family in FAMILIES if not asked or family.name in asked]
