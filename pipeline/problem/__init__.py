"""The problem file: typed, with units, checked. `load` is the way in."""

from pipeline.problem.identity import (
    Stage,
    canonical_json,
    content_hash,
    from_canonical,
    section_hash,
)
from pipeline.problem.loading import load, preset_names
from pipeline.problem.model import Problem
from pipeline.problem.outputs import Output, outputs
from pipeline.problem.roles import (
    cloak_units,
    inclusion_units,
    interest_units,
    source_units,
    void_units,
)
from pipeline.problem.selection import selected_units, units_within

__all__ = [
    "Output",
    "Problem",
    "Stage",
    "canonical_json",
    "cloak_units",
    "content_hash",
    "from_canonical",
    "inclusion_units",
    "interest_units",
    "load",
    "outputs",
    "preset_names",
    "section_hash",
    "selected_units",
    "source_units",
    "units_within",
    "void_units",
]
