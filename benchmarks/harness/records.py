"""Defines what is measured and what comes out of it: plain records."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from sim.core import Floats

if TYPE_CHECKING:  # every worker loads this module: it stays light
    import xarray as xr

    from pipeline.datasets.tables import Kind

Task = Literal["loss", "gradient"]
Tell = Callable[[str], None]
NAN = float("nan")


class Sample(NamedTuple):
    """Holds the results of one run of a method."""

    # results by name. Each is compared with the reference's result of the same name; in the table
    # it stands in the column named by what comes before "@" ("loss@45 deg" under "loss").
    values: Mapping[str, Floats]
    work: Mapping[str, int]  # counts of what was done (steps, force evaluations, factorisations)


Run = Callable[[], Sample]


@dataclass(frozen=True)
class Method:
    """Names one way to compute a suite's result, and its settings."""

    name: str  # as the table shows it
    # builds and compiles; the run that it returns is what is timed. It is sent to a process of its
    # own: a function of a module, or a ``functools.partial`` of one. It takes the value of a
    # setting and the task, or nothing where there are no settings.
    prepare: Callable[..., Run]
    settings: tuple[tuple[str, float], ...] = ()  # from loose to tight, by name and value
    own: bool = True  # whether it is one of ours
    tasks: tuple[Task, ...] = ("loss", "gradient")  # what it can do
    repeats: int | None = None  # at most so many timed runs; None for as many as asked for
    share: float = 1.0  # part of the whole job that a run does, by which times are divided
    timed: bool = True  # False for stored numbers, which are compared and nothing else
    baseline: bool = False  # whether its last stored figures may stand in for a new measurement
    note: str = ""  # what a reader of the table must know


@dataclass(frozen=True)
class Measurement:
    """Holds the figures of a method at a setting."""

    method: str
    setting: str = ""
    task: Task = "gradient"
    own: bool = True
    note: str = ""
    units: int = 0  # of the lattice
    compile_s: float = NAN  # wall time to build, compile and warm up, s
    cpu_s: tuple[float, ...] = ()  # s, processor time of each run, for the whole job
    wall_s: tuple[float, ...] = ()  # s, the same by the clock: longer on a shared machine
    errors: Mapping[str, float] = field(default_factory=dict)  # relative, by name of the value
    work: Mapping[str, int] = field(default_factory=dict)  # counts, of what one run did
    peak_mib: float = NAN  # peak resident memory of the process, MiB
    failure: str = ""  # why it has no figures, or empty

    @property
    def name(self) -> str:
        """Joins method, setting and task; without a setting, the method alone."""
        return f"{self.method}, {self.setting}, {self.task}" if self.setting else self.method

    @property
    def seconds(self) -> float:
        """Returns the median processor time of the whole job, s; nan if there is none."""
        return float(np.median(self.cpu_s)) if self.cpu_s else NAN

    @property
    def spread(self) -> float:
        """Returns half the range of the runs over their median; nan for fewer than two runs."""
        if len(self.cpu_s) < 2:
            return NAN
        return (max(self.cpu_s) - min(self.cpu_s)) / 2 / self.seconds

    def error(self, quantity: str) -> float:
        """Returns the largest error of the values in a column; nan if there is none."""
        found = [error for name, error in self.errors.items() if column(name) == quantity]
        return float(np.max(found)) if found else NAN  # nan where one of them is


Measured = Mapping[str, Measurement]
"""Measurements by the names of their methods."""


@dataclass(frozen=True)
class Target:
    """Sets a limit to a number that is computed from measurements."""

    name: str
    value: Callable[[Measured], float]  # the number; nan where something was not measured
    unit: str = ""
    at_most: float | None = None  # what it must keep to; or:
    at_least: float | None = None
    aim: float | None = None  # what is hoped for

    def verdict(self, measured: Measured) -> tuple[float, str]:
        """Returns the number and "met", "missed" or "not measured"."""
        value = self.value(measured)
        if np.isnan(value):
            return value, "not measured"
        low = self.at_least is None or value >= self.at_least
        high = self.at_most is None or value <= self.at_most
        return value, "met" if low and high else "missed"


@dataclass(frozen=True)
class MeasuringLimits:
    """Bounds the time that measurements take."""

    repeats: int = 5  # runs of a point or rounds of a suite, fewer if they are long
    limit_s: float = 90.0  # processor time that preparing or one run of a setting may take, s
    skipped: tuple[str, ...] = ()  # methods that are not measured now
    stored: Measured = field(default_factory=dict)  # older figures of these, if there are any


@dataclass(frozen=True)
class Suite:
    """Groups what is measured together."""

    name: str  # of the suite; its dataset bears it
    subject: str  # what one run computes
    reference: str  # what errors are measured against
    measure: Callable[[MeasuringLimits, Tell], list[Measurement] | xr.Dataset]
    kind: Kind = "benchmark"  # of the dataset
    targets: tuple[Target, ...] = ()  # to be met
    in_turn: bool = False  # whether its methods run in turn on one core, for comparison
    short: bool = False  # whether it belongs to the short benchmark
    baselines: tuple[str, ...] = ()  # methods whose stored figures may stand in for new ones

    def verdicts(self, measurements: list[Measurement]) -> Iterator[tuple[Target, float, str]]:
        """Yields every target with its number and verdict."""
        by_name = {one.name: one for one in measurements}
        for target in self.targets:
            yield (target, *target.verdict(by_name))


def settings_of(values: Iterable[float], unit: str = "") -> tuple[tuple[str, float], ...]:
    """Names settings by their values."""
    return tuple((f"{value:g}{unit}", value) for value in values)


def column(name: str) -> str:
    """Returns the column of the table that a value's error stands in."""
    return name.partition("@")[0]


def quantities(measurements: list[Measurement]) -> list[str]:
    """Lists the columns of errors that any measurement has, in order of appearance."""
    return list(dict.fromkeys(column(name) for one in measurements for name in one.errors))


def errors(values: Mapping[str, Floats], reference: Mapping[str, Floats]) -> dict[str, float]:
    """Returns the relative l2 error of every value that the reference has too."""
    return {
        name: float(np.linalg.norm(value - reference[name]) / np.linalg.norm(reference[name]))
        for name, value in values.items()
        if name in reference
    }


def seconds_of(name: str) -> Callable[[Measured], float]:
    """Makes the value of a target: a method's time."""
    return lambda measured: _of(measured, name).seconds


def error_of(name: str, quantity: str) -> Callable[[Measured], float]:
    """Makes the value of a target: a method's error."""
    return lambda measured: _of(measured, name).error(quantity)


def time_ratio(slow: str, fast: str) -> Callable[[Measured], float]:
    """Makes the value of a target: one method's time over that of another."""
    return lambda measured: _of(measured, slow).seconds / _of(measured, fast).seconds


def _of(measured: Measured, name: str) -> Measurement:
    return measured.get(name, Measurement(name))
