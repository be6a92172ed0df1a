"""What a benchmark is, and what comes out of it: plain records."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from sim.core import Floats


class Sample(NamedTuple):
    """What one run of a candidate found.

    Attributes:
        values: results by name. Each is compared with the reference's result of the same name; in
            the table it stands in the column named by what comes before "@" ("loss@45 deg" under
            "loss").
        work: counts of what was done (steps, force evaluations, factorisations).
    """

    values: Mapping[str, Floats]
    work: Mapping[str, int]


Run = Callable[[], Sample]


@dataclass(frozen=True)
class Candidate:
    """One way to compute what a benchmark asks for.

    Attributes:
        name: as the table shows it.
        prepare: builds and compiles; the run that it returns is what is timed. It is sent to a
            process of its own: a function of a module, or a ``functools.partial`` of one.
        repeats: at most so many timed runs; None for as many as asked for.
        share: part of the whole job that a run does; times are divided by it (one of four load
            cases: 0.25).
        timed: False for stored numbers, which are compared with the reference and nothing else.
        baseline: whether its last stored figures may stand in for a new measurement.
        note: what a reader of the table must know.
    """

    name: str
    prepare: Callable[[], Run]
    repeats: int | None = None
    share: float = 1.0
    timed: bool = True
    baseline: bool = False
    note: str = ""


@dataclass(frozen=True)
class CandidateResult:
    """Figures of one candidate.

    Attributes:
        name, note: of the candidate.
        compile_s: wall time to build, compile and warm up, s.
        cpu_s: processor time of each run over the share of the job that it did, s.
        wall_s: the same by the clock, s; longer on a machine that others use too.
        errors: relative error of each value by its name.
        work: counts, of what one run did.
        peak_mib: peak resident memory of the candidate's process, MiB.
        failure: why it has no figures, or empty.
        stored: date, machine and commit of an older measurement that these figures are from, or
            empty.
    """

    name: str
    note: str = ""
    compile_s: float = float("nan")
    cpu_s: tuple[float, ...] = ()
    wall_s: tuple[float, ...] = ()
    errors: Mapping[str, float] = field(default_factory=dict)
    work: Mapping[str, int] = field(default_factory=dict)
    peak_mib: float = float("nan")
    failure: str = ""
    stored: str = ""

    @property
    def seconds(self) -> float:
        """Median processor time of the whole job, s; nan if there is none."""
        return float(np.median(self.cpu_s)) if self.cpu_s else float("nan")

    @property
    def spread(self) -> float:
        """Half the range of the runs over their median; nan for fewer than two runs."""
        if len(self.cpu_s) < 2:
            return float("nan")
        return (max(self.cpu_s) - min(self.cpu_s)) / 2 / self.seconds

    def error(self, kind: str) -> float:
        """Largest error of the values in the column ``kind``; nan if there is none."""
        found = [error for name, error in self.errors.items() if column(name) == kind]
        return max(found, default=float("nan"))


Outcomes = Mapping[str, CandidateResult]


@dataclass(frozen=True)
class Target:
    """A number that the benchmark must reach.

    Attributes:
        name, unit: as shown.
        value: the number, from the outcomes by candidate; nan where something was not measured.
        at_most, at_least: what it must keep to; one of the two.
        aim: what is hoped for.
    """

    name: str
    value: Callable[[Outcomes], float]
    unit: str = ""
    at_most: float | None = None
    at_least: float | None = None
    aim: float | None = None

    def verdict(self, outcomes: Outcomes) -> tuple[float, str]:
        """The number and "met", "missed" or "not measured"."""
        value = self.value(outcomes)
        if np.isnan(value):
            return value, "not measured"
        low = self.at_least is None or value >= self.at_least
        high = self.at_most is None or value <= self.at_most
        return value, "met" if low and high else "missed"


@dataclass(frozen=True)
class Benchmark:
    """A named scene with the ways to compute it.

    Attributes:
        name: of the scene; the stored files bear it.
        title: a line that says what one run does.
        reference: prepared and run once; gives the values that errors are measured against.
        candidates: in the order of the table.
        targets: to be met.
        short: whether it belongs to the short benchmark.
    """

    name: str
    title: str
    reference: Callable[[], Run]
    candidates: tuple[Candidate, ...]
    targets: tuple[Target, ...] = ()
    short: bool = True


@dataclass(frozen=True)
class BenchmarkReport:
    """A benchmark's figures as they are printed and stored.

    Attributes:
        benchmark: what was run.
        outcomes: in the order of its candidates.
        machine: where and when, and from which commit.
    """

    benchmark: Benchmark
    outcomes: tuple[CandidateResult, ...]
    machine: Mapping[str, Any]

    @property
    def verdicts(self) -> list[tuple[Target, float, str]]:
        """Every target with its number and verdict."""
        by_name = {outcome.name: outcome for outcome in self.outcomes}
        return [(target, *target.verdict(by_name)) for target in self.benchmark.targets]


def column(name: str) -> str:
    """Column of the table that a value's error stands in."""
    return name.partition("@")[0]


def errors(values: Mapping[str, Floats], reference: Mapping[str, Floats]) -> dict[str, float]:
    """Relative l2 error of every value that the reference has too."""
    return {
        name: float(np.linalg.norm(value - reference[name]) / np.linalg.norm(reference[name]))
        for name, value in values.items()
        if name in reference
    }


def seconds_of(name: str) -> Callable[[Outcomes], float]:
    """Target value: a candidate's time."""
    return lambda outcomes: _of(outcomes, name).seconds


def error_of(name: str, kind: str) -> Callable[[Outcomes], float]:
    """Target value: a candidate's error."""
    return lambda outcomes: _of(outcomes, name).error(kind)


def speed_up(fast: str, slow: str) -> Callable[[Outcomes], float]:
    """Target value: how many times faster one candidate is than another."""
    return lambda outcomes: _of(outcomes, slow).seconds / _of(outcomes, fast).seconds


def _of(outcomes: Outcomes, name: str) -> CandidateResult:
    return outcomes.get(name, CandidateResult(name))
