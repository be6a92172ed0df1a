"""Measures methods: in turn on one core, or setting after setting."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial

from benchmarks.harness.records import (
    NAN,
    Measurement,
    MeasuringLimits,
    Method,
    Run,
    Suite,
    Target,
    Task,
    Tell,
    errors,
)
from benchmarks.harness.workers import CandidateError, Timed, Worker
from sim.core import Floats

ENOUGH_S = 5.0
"""Processor time of the runs of a setting after which it is not repeated any more."""


def result_of(prepare: Callable[..., Run], *arguments: object) -> Mapping[str, Floats]:
    """Returns the values of one run, computed in a process of its own.

    Raises:
        CandidateError: they could not be computed.
    """
    with Worker(prepare) as worker:
        worker.prepare(*arguments)
        return worker.run().sample.values


def measure_in_turn(
    reference: Callable[[], Run],
    methods: Sequence[Method],
    units: int,
    limits: MeasuringLimits,
    tell: Tell,
) -> list[Measurement]:
    """Runs all methods alive at once, one run at a time: A B C, A B C, ...

    `reference` is run once and gives the values that errors are measured against; the methods have
    no settings.

    Raises:
        CandidateError: the reference could not be computed.
    """
    tell("reference")
    wanted = result_of(reference)
    with ExitStack() as stack:
        points = {
            one.name: _MeasuredSetting(one, stack.enter_context(Worker(one.prepare)))
            for one in methods
            if one.name not in limits.skipped
        }
        for name, point in points.items():
            tell(f"compiling {name}")
            point.prepare()
        for round_ in range(limits.repeats):
            for name, point in points.items():
                if point.runs_in(round_):
                    point.run()
                    tell(f"round {round_ + 1} of {limits.repeats}: {name}: {point.last}")
        measured = {name: point.measurement(wanted, units) for name, point in points.items()}
    known = {**limits.stored, **measured}
    return [known[one.name] for one in methods if one.name in known]


def measure_settings(
    method: Method, reference: Mapping[str, Floats], units: int, limits: MeasuringLimits, tell: Tell
) -> list[Measurement]:
    """Measures every setting for every task; after one that takes too long, no tighter ones."""
    measured: list[Measurement] = []
    for task in method.tasks:
        with Worker(method.prepare, limits.limit_s) as worker:
            stopped = ""
            for setting, value in method.settings:
                point = _MeasuredSetting(method, worker, setting, task, (value, task))
                if stopped:
                    point.failure = stopped
                else:
                    point.prepare()
                for round_ in range(limits.repeats):
                    if point.runs_in(round_) and point.spent_s < ENOUGH_S:
                        point.run()
                measured.append(point.measurement(reference, units))
                if not stopped and not worker.alive:
                    stopped = f"not tried: {setting} {point.failure}"
                one = measured[-1]
                tell(f"{one.name}: {one.failure or f'{one.seconds:.3g} s'}")
    return measured


def in_turn(
    name: str,
    subject: str,
    reference: tuple[str, Callable[[], Run]],
    methods: tuple[Method, ...],
    targets: tuple[Target, ...],
    units: int,
    short: bool = True,
) -> Suite:
    """Makes a suite of methods that run in turn; the reference in words and as a run."""
    told, prepare = reference
    measure = partial(measure_in_turn, prepare, methods, units)
    baselines = tuple(method.name for method in methods if method.baseline)
    return Suite(name, subject, told, measure, "benchmark", targets, True, short, baselines)


class _MeasuredSetting:
    """Measures a method at a setting; the arguments go to the worker to prepare it."""

    def __init__(
        self,
        method: Method,
        worker: Worker,
        setting: str = "",
        task: Task = "gradient",
        arguments: tuple[object, ...] = (),
    ) -> None:
        self._method, self._worker, self._arguments = method, worker, arguments
        self._setting, self._task = setting, task
        self._compile_s = NAN
        self._runs: list[Timed] = []
        self.failure = ""

    @property
    def spent_s(self) -> float:
        """Returns the processor time of the runs so far."""
        return sum(run.cpu_s for run in self._runs)

    @property
    def last(self) -> str:
        """Returns the result of the last run."""
        return self.failure or f"{self._runs[-1].cpu_s:.3g} s"

    def prepare(self) -> None:
        """Builds and compiles it."""
        try:
            self._compile_s = self._worker.prepare(*self._arguments)
        except CandidateError as failed:
            self.failure = str(failed)

    def runs_in(self, round_: int) -> bool:
        """Tests whether it runs in that round."""
        most = self._method.repeats if self._method.timed else 1
        return not self.failure and (most is None or round_ < most)

    def run(self) -> None:
        """Runs it once."""
        try:
            self._runs.append(self._worker.run())
        except CandidateError as failed:
            self.failure = str(failed)

    def measurement(self, reference: Mapping[str, Floats], units: int) -> Measurement:
        """Returns its figures."""
        method, timed = self._method, self._method.timed
        named = (method.name, self._setting, self._task, method.own, method.note, units)
        if self.failure or not self._runs:
            return Measurement(*named, failure=self.failure or "was not run")
        sample, runs = self._runs[-1].sample, self._runs if timed else []
        return Measurement(
            *named,
            compile_s=self._compile_s if timed else NAN,
            cpu_s=tuple(run.cpu_s / method.share for run in runs),
            wall_s=tuple(run.wall_s / method.share for run in runs),
            errors=errors(sample.values, reference),
            work=dict(sample.work),
            peak_mib=self._worker.peak_mib() if timed else NAN,
        )
