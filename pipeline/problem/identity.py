"""Canonical text and hashes of a problem, whole or as far as one stage depends on it."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.model import SWITCHES, Problem
from pipeline.runtime import STAGES

REPORT = "report"
"""The stage that depends on all of a problem: the pages."""

_SLOTS: dict[str, Any] = {
    **dict.fromkeys(("minimum_wall", "minimum_gap", "fillet_radius", "slots"), True),
    "shims": {"thickness"},
}
"""Of the fabrication, what slots as they are drawn depend on."""


def canonical_json(problem: Problem, stage: str = REPORT, method: str | None = None) -> str:
    """The problem in working units as JSON with sorted keys: equal problems, equal bytes.

    What a stage of the table does not depend on is left out (`REPORT` needs all), and so are the
    other optimisation methods than one that is given.
    """
    data = problem.model_dump(mode="json", by_alias=True, exclude_none=True)
    _keep_switches(data)
    for name in () if stage == REPORT else _unused(problem, stage):
        data.pop(name, None)
    limits = data.get("constraints")
    if isinstance(limits, dict) and not limits["straight_shims"]:
        limits.pop("straight_shims")  # as before there was the key
    if "optimiser" in data and not problem.optimiser.as_built:
        data["optimiser"].pop("as_built")  # likewise
    if stage == "as_built":
        data["fabrication"] = _fabrication_of_slots(problem)
    elif "fabrication" not in data and (needed := _fabrication_of_design(problem, limits or {})):
        data["fabrication"] = needed
    if stage not in ("redesign", REPORT):
        data["optimiser"].pop("geometric")
    if method is not None:
        methods = data["optimiser"]["methods"]
        data["optimiser"]["methods"] = {method: methods[method]}
    return json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)


def _unused(problem: Problem, stage: str) -> tuple[str, ...]:
    """Lists the sections that a stage does not depend on."""
    passes = _passes_what_is_shown(problem, stage)
    listed = STAGES[stage].unused or ()
    return tuple(name for name in listed if not (passes and name == "response"))


def _passes_what_is_shown(problem: Problem, stage: str) -> bool:
    """Tells whether a stage passes the loads, or the instants, that the response shows.

    A design under slow loads is confirmed by a path through them, unless its loads are in ranges.
    """
    if stage == "verify":
        return not problem.static
    slow = problem.static and problem.objective.loads is None
    return slow and stage in ("design", "redesign")


def _keep_switches(data: dict[str, Any]) -> None:
    """Writes null for what is off though it is on by default, in a problem as dumped."""
    for *above, last in SWITCHES:
        section = data
        for key in above:
            section = section.get(key, {})
        if section:
            section.setdefault(last, None)


def _fabrication_of_design(problem: Problem, limits: Mapping[str, Any]) -> dict[str, Any]:
    """Lists what a design with bounded strains, or with room for slots, depends on besides."""
    needed: dict[str, Any] = {}
    slotted = "straight_shims" in limits or problem.optimiser.as_built
    if "shim_strain" in limits or slotted:
        needed["shims"] = {"thickness": problem.shim_thickness}
    if slotted:
        made = problem.fabrication
        sizes = made.slots.model_dump(include={"depth_min", "depth_max", "clearance", "tip"})
        needed |= {"slots": sizes, "minimum_wall": made.minimum_wall}
    return needed


def _fabrication_of_slots(problem: Problem) -> dict[str, Any]:
    """Lists what structures as built depend on, without the tabs, which are to fit to the kerf."""
    needed = problem.fabrication.model_dump(mode="json", include=_SLOTS)
    needed["shims"]["tabs"] = None
    return needed


def from_canonical(text: str | dict[str, Any]) -> Problem:
    """The problem that `canonical_json` wrote (sections left out have their defaults)."""
    data = json.loads(text) if isinstance(text, str) else text
    return Problem.model_validate(data, context=SIM_UNITS)


def content_hash(problem: Problem) -> str:
    """SHA-256 of the whole problem, in hex."""
    return _sha256(canonical_json(problem))


def section_hash(problem: Problem, stage: str, method: str | None = None) -> str:
    """SHA-256 of what a stage depends on, in hex: equal hashes, no need to run it again."""
    return _sha256(canonical_json(problem, stage, method))


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
