"""Describes claims in numbers, the paper's and our own, assessed by the facts of the reports.

reports/facts/claims.yaml lists the paper's, own_claims.yaml ours; all but the values is computed.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pipeline.problem.fields import Section, exactly_one, fault
from pipeline.problem.reading import load_section
from pipeline.runtime import UserError
from reports.facts.fact_records import ABSENT, Fact, worded

Relation = Literal["is", "about", "at least", "at most", "above", "below"]
Status = Literal["holds", "does not hold", "not yet evaluated", "not claimed"]

ABOUT = 0.1
"""Share of the paper's value by which ours may differ where it is only about the same."""
MEASURED = "measured_"
"""Begins the keys of facts that are those of the recordings."""


class Claim(Section):
    """Describes one claim; claims.yaml tells what its keys mean."""

    study: str
    line: Annotated[int, Field(gt=0)] | None = None
    paper: str | None = None
    meaning: str | None = None
    ours: str | None = None
    relation: Relation
    fact: str
    of: Literal["setting", "simulation", "both"]
    says: str

    @model_validator(mode="after")
    def _one_number(self) -> Self:
        exactly_one(self, "paper", "meaning", "ours")
        if (self.line is None) is (self.ours is None):
            raise fault("the paper's claims have a line, ours have none", "correct it", "line")
        return self

    @property
    def number(self) -> str:
        """Returns the number as the file has it."""
        return self.paper or self.meaning or self.ours or ""

    @property
    def quoted(self) -> str:
        """Returns the number in words."""
        return self.number.replace(" x ", " × ").replace(" deg", "°")

    @property
    def tolerance(self) -> str:
        """Tells what may be said to agree with it, in words."""
        if self.relation == "is":
            return "as quoted: less than half of its last digit off"
        return f"within {ABOUT:.0%}" if self.relation == "about" else self.relation


class Claims(Section):
    """Describes all claims, and where they are made."""

    source: str
    claims: tuple[Claim, ...]


@dataclass(frozen=True)
class Side:
    """States what simulation or experiment says of a claim: its number in words, and whether.

    `why` tells what is missing where there is no number.
    """

    ours: str
    status: Status
    why: str = ""


@dataclass(frozen=True)
class AssessedClaim:
    """Describes a claim with what became of it; `note` tells how our number is taken."""

    claim: Claim
    simulation: Side
    experiment: Side
    note: str

    @property
    def both(self) -> Status:
        """Tells whether it holds in simulation and in experiment, of a claim on both."""
        sides = [self.simulation.status, self.experiment.status]
        order: tuple[Status, ...] = ("does not hold", "not yet evaluated", "holds")
        return next(status for status in order if status in sides)


@cache
def listed() -> Claims:
    """Returns the paper's claims."""
    return load_section(Path(__file__).with_name("claims.yaml"), Claims)


@cache
def own() -> Claims:
    """Returns our own claims."""
    return load_section(Path(__file__).with_name("own_claims.yaml"), Claims)


def assessed(study: str, facts: Sequence[Fact]) -> list[AssessedClaim]:
    """Returns the claims on a study, by the facts of its report; with none of them, all are open.

    Raises:
        UserError: a fact is in another unit than the claim on it.
    """
    known = {fact.key: fact for fact in facts}
    every = (*listed().claims, *own().claims)
    return [_assess(claim, known) for claim in every if claim.study == study]


def quoted(found: Sequence[AssessedClaim]) -> bool:
    """Tells whether claims are the paper's."""
    return any(each.claim.ours is None for each in found)


def verdict(found: Sequence[AssessedClaim], label: str = "") -> str:
    """Tells how many claims hold, in one line; `label` marks an experiment that was rendered."""
    simulated = [each.simulation.status for each in found]
    both = [each for each in found if each.claim.of == "both"]
    measured = [each.experiment.status for each in both]
    parts = [f"{_counted(simulated)} in simulation"]
    if both:
        parts.append(f"{_counted(measured)} in experiment" + f" ({label})" * bool(label))
        parts.append(f"{_counted([each.both for each in both])} in both")
    return "Claims that hold: " + ", ".join(parts) + "."


def _counted(statuses: Sequence[Status]) -> str:
    words = f"{statuses.count('holds')} of {len(statuses)}"
    waiting = statuses.count("not yet evaluated")
    return f"{words} ({waiting} not yet evaluated)" if waiting else words


def _assess(claim: Claim, known: Mapping[str, Fact]) -> AssessedClaim:
    prefix, dot, key = claim.fact.rpartition(".")
    spacing = known.get(f"{prefix}{dot}spacing") or known.get("spacing")
    fact = known.get(claim.fact)
    missing = "no result" if known else "study not built"
    simulation = _side(claim, fact, spacing, missing)
    experiment = Side(ABSENT, "not claimed")
    if claim.of == "both":
        measured = known.get(f"{prefix}{dot}{MEASURED}{key}")
        experiment = _side(claim, measured, spacing, "no recording compared")
    return AssessedClaim(claim, simulation, experiment, fact.note if fact else "")


def _side(claim: Claim, fact: Fact | None, spacing: Fact | None, missing: str) -> Side:
    if fact is None or not math.isfinite(fact.value):
        return Side(ABSENT, "not yet evaluated", missing)
    value, unit, place = parsed(claim.number)
    ours = fact.ours
    if unit == "spacings" and spacing is not None:
        value, unit, place = value * spacing.value, spacing.unit, place * spacing.value
        ours += f" = {worded(fact.value / spacing.value, 'spacings', 3)}"
    if unit != fact.unit:
        raise UserError(
            f"the fact is in {fact.unit}, the claim in {unit}",
            file=Path(__file__).with_name("own_claims.yaml" if claim.ours else "claims.yaml"),
            key=claim.fact,
            remedy="give the claim in the unit of the fact",
        )
    holds = agrees(fact.value, claim.relation, value, place)
    return Side(ours, "holds" if holds else "does not hold")


def agrees(ours: float, relation: Relation, paper: float, place: float) -> bool:
    """Tells whether our number stands in the relation to the paper's, quoted to `place`.

    It is rounded to that: a number half of `place` off is another.
    """
    half = place / 2 * (1 - 1e-9)
    return {
        "is": abs(ours - paper) < half,
        "about": abs(ours - paper) <= ABOUT * abs(paper),
        "at least": ours > paper - half,
        "at most": ours < paper + half,
        "above": ours > paper,
        "below": ours < paper,
    }[relation]


def parsed(text: str) -> tuple[float, str, float]:
    """Returns value, unit and last place of "5.2 mm", "64 %" or "15 x 15" (a number of units)."""
    if " x " in text:
        return math.prod(map(float, text.split(" x "))), "1", 1.0
    number, _, unit = text.partition(" ")
    return float(number), unit or "1", 10.0 ** -len(number.partition(".")[2])
