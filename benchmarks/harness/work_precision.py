"""Ladders: one method at ever tighter settings, measured in a process of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

from benchmarks.harness.records import Candidate, CandidateResult, Run
from benchmarks.harness.workers import AtWork, Tell, Worker
from sim.core import Floats

Task = Literal["loss", "gradient"]
ENOUGH_S = 5.0
"""Processor time of the runs of a point after which it is not repeated any more."""


@dataclass(frozen=True)
class SettingLadder:
    """A method and its settings.

    Attributes:
        method: its name.
        prepare: builds and compiles for the value of a setting and a task; sent to a process of
            its own.
        rungs: settings from loose to tight, by name and value.
        own: whether it is one of ours.
        tasks: what it can do.
        repeats: at most so many runs of a point.
    """

    method: str
    prepare: Callable[..., Run]
    rungs: tuple[tuple[str, float], ...]
    own: bool = False
    tasks: tuple[Task, ...] = ("loss", "gradient")
    repeats: int | None = None


class WorkPrecisionPoint(NamedTuple):
    """A method at a setting, and what came of it.

    Attributes:
        method, setting, task, own: as in the ladder.
        units: of the lattice.
        outcome: its figures.
    """

    method: str
    setting: str
    task: Task
    own: bool
    units: int
    outcome: CandidateResult


@dataclass(frozen=True)
class MeasuringLimits:
    """How long points may take.

    Attributes:
        repeats: runs of a point, fewer if they are long.
        limit_s: processor time that preparing or one run may take.
    """

    repeats: int = 5
    limit_s: float = 90.0


def climb(
    ladder: SettingLadder,
    reference: Mapping[str, Floats],
    rules: MeasuringLimits,
    units: int,
    tell: Tell,
) -> list[WorkPrecisionPoint]:
    """Measures every rung for every task; once one takes too long, tighter ones are not tried."""
    points: list[WorkPrecisionPoint] = []
    for task in ladder.tasks:
        with Worker(ladder.prepare, rules.limit_s) as worker:
            stopped = ""
            for setting, value in ladder.rungs:
                named = Candidate(
                    f"{ladder.method}, {setting}, {task}", ladder.prepare, ladder.repeats
                )
                at_work = AtWork(named, worker, value, task)
                outcome = CandidateResult(named.name, failure=stopped)
                if not stopped:
                    outcome = _measured(at_work, reference, rules)
                    stopped = "" if worker.alive else f"not tried: {setting} {outcome.failure}"
                tell(f"{named.name}: {outcome.failure or f'{outcome.seconds:.3g} s'}")
                points.append(
                    WorkPrecisionPoint(ladder.method, setting, task, ladder.own, units, outcome)
                )
    return points


def _measured(
    at_work: AtWork, reference: Mapping[str, Floats], rules: MeasuringLimits
) -> CandidateResult:
    at_work.prepare()
    for round_ in range(rules.repeats):
        if at_work.wants(round_) and at_work.spent_s < ENOUGH_S:
            at_work.run()
    return at_work.outcome(reference)
