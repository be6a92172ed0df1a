"""The schema of every dataset, as tables: which variables, on which dims, in what unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pipeline.datasets.comparisons import COMPARED, COMPARISON
from pipeline.datasets.designs import DESIGN, DESIGNMETHOD
from pipeline.datasets.responses import RESPONSE, SWEEP
from pipeline.datasets.tracks import RECORDED, TRACK, TRUTH
from pipeline.datasets.trials import SCATTER, VERIFICATION
from pipeline.datasets.variables import Table

SCHEMA_VERSION = 1

Kind = Literal[
    "design",
    "design_method",
    "response",
    "sweep",
    "scatter",
    "verification",
    "track",
    "truth",
    "comparison",
]

TABLES: Mapping[Kind, Table] = {
    "design": DESIGN,
    "design_method": DESIGNMETHOD,
    "response": RESPONSE,
    "sweep": SWEEP,
    "scatter": SCATTER,
    "verification": VERIFICATION,
    "track": TRACK,
    "truth": TRUTH,
    "comparison": COMPARISON,
}
"""The variables of each kind of dataset, in the order in which they are written."""

ATTRIBUTES: Mapping[Kind, Mapping[str, str]] = {
    "design": {"shipped_method": "the method whose design this is"},
    "design_method": {},
    "response": {},
    "sweep": {},
    "scatter": {},
    "verification": {},
    "track": RECORDED,
    "truth": RECORDED,
    "comparison": COMPARED,
}
"""What each kind tells in attributes of its own, beside its provenance."""
