"""Judges attempts: solved, refused or wrong.

A case is solved if everything that is checked of its answer keeps within its
limit, refused if it ends in an error that says what to do, and wrong otherwise.
"""

import sys
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import yaml

from sim.core import SimulationError

Verdict = Literal["solved", "refused", "wrong"]
ExpectedVerdict = Literal["solution", "either", "refusal"]

STATED_OVER_TRUE = "stated error over the true one"
"""Names the check whose median and 95 % are told of a family."""
REMEDIES = (
    "; try ", "; ask for ", "; loosen ", "; hold ", "or mend ", "; make ", "; clamp ", "; lower ",
)  # fmt: skip
"""How the messages of actionable refusals begin to say what to do."""


class Check(NamedTuple):
    """Checks one number of an answer by an independent calculation."""

    name: str  # with the number's unit
    value: float  # the number
    limit: float  # the largest that passes; NaN does not
    stated: bool = False  # whether the result itself tells that number, as an estimate of its error

    @property
    def within_limit(self) -> bool:
        """Tests whether the number is within its limit."""
        return self.value <= self.limit

    @property
    def share(self) -> float:
        """Returns the number over its limit; where that is zero, the number."""
        return self.value / self.limit if self.limit else self.value


@dataclass(frozen=True)
class StressCase:
    """Poses one attempt."""

    name: str  # what is tried
    attempt: Callable[[], Sequence[Check]]  # solves and returns what it checked of the answer
    # a solution, as a study may ask for it and a refusal counts against the solver; a refusal, as
    # there is no answer and any would be wrong; or either, and then an answer may also be one whose
    # own estimate of error says that it is none
    expected: ExpectedVerdict = "solution"


def attempt(
    name: str,
    check: Callable[..., Sequence[Check]],
    *arguments: Any,  # noqa: ANN401  (of the check)
    expected: ExpectedVerdict = "solution",
) -> StressCase:
    """Poses an attempt whose check takes arguments."""
    return StressCase(name, partial(check, *arguments), expected)


class StressOutcome(NamedTuple):
    """Holds the verdict on one attempt, why, and what was checked."""

    case: StressCase
    verdict: Verdict
    message: str
    checks: tuple[Check, ...]


Cases = Callable[[bool], Iterable[StressCase]]
"""Makes cases; few ones if asked for a small suite."""


class StressFamily(NamedTuple):
    """Names cases of one kind, with lines that say what is tried and how an answer is judged."""

    name: str
    tried: str
    judged: str
    cases: Cases
    endless: bool = False  # whether its cases are drawn at random, as many as are asked for


_TEXTS = yaml.safe_load(Path(__file__).with_name("families.yaml").read_text(encoding="utf-8"))


def family(cases: Cases) -> StressFamily:
    """Decorates a function that makes cases: a family of its name, told of in families.yaml."""
    name, known = cases.__name__, vars(sys.modules[cases.__module__])
    texts = {key: text.format_map(known) for key, text in _TEXTS[name].items()}
    return StressFamily(name, **texts, cases=cases)


def endless_family(cases: Cases) -> StressFamily:
    """Decorates a function that draws cases without an end."""
    return family(cases)._replace(endless=True)


@dataclass(frozen=True)
class Tally:
    """Counts the outcomes of one family."""

    family: StressFamily
    outcomes: tuple[StressOutcome, ...]

    @cached_property
    def counts(self) -> Counter[Verdict]:
        """Counts the outcomes of each verdict."""
        return Counter(outcome.verdict for outcome in self.outcomes)

    @property
    def in_range(self) -> tuple[int, int]:
        """Counts the cases that a study may ask for: tried, and solved."""
        asked = [outcome for outcome in self.outcomes if outcome.case.expected == "solution"]
        return len(asked), sum(outcome.verdict == "solved" for outcome in asked)

    @property
    def overstated(self) -> tuple[float, float]:
        """Returns median and 95 % of stated errors over true ones; NaN where none is stated."""
        found = [
            check.value
            for outcome in self.outcomes
            for check in outcome.checks
            if check.name == STATED_OVER_TRUE
        ]
        return (
            (float(np.median(found)), float(np.quantile(found, 0.95))) if found else (np.nan,) * 2
        )

    @property
    def worst(self) -> list[Check]:
        """Lists the check of each name that came closest to its limit in solved cases."""
        solved = (outcome.checks for outcome in self.outcomes if outcome.verdict == "solved")
        found: dict[str, Check] = {}
        for check in (check for checks in solved for check in checks):
            known = found.setdefault(check.name, check)
            found[check.name] = check if check.share > known.share else known
        return list(found.values())


def run_attempt(case: StressCase) -> StressOutcome:
    """Runs a case and gives the verdict."""
    try:
        checks = tuple(case.attempt())
    except SimulationError as error:
        return _refusal(case, str(error))
    except Exception:  # noqa: BLE001  (whatever else a solver raises is no answer to a user)
        *_, last = traceback.format_exc().strip().splitlines()
        return StressOutcome(case, "wrong", f"raised {last}", ())
    if case.expected == "refusal":
        return StressOutcome(case, "wrong", "it has no answer, and was given one", checks)
    missed = [check for check in checks if not check.within_limit]
    said = "; ".join(f"{miss.name}: {miss.value:.3g}, limit {miss.limit:.3g}" for miss in missed)
    if case.expected == "either" and any(miss.stated for miss in missed):
        return StressOutcome(case, "refused", f"by its own estimate of error: {said}", checks)
    return StressOutcome(case, "wrong" if missed else "solved", said, checks)


def _refusal(case: StressCase, message: str) -> StressOutcome:
    actionable = any(remedy in message for remedy in REMEDIES)
    return StressOutcome(case, "refused" if actionable else "wrong", message, ())
