"""Measuring: every candidate in a process of its own, all on one core, one run at a time."""

from __future__ import annotations

import math
import multiprocessing
import os
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import psutil

from benchmarks.harness.records import Benchmark, Candidate, CandidateResult, Run, Sample, errors
from sim.core import Floats

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
Tell = Callable[[str], None]
_PATIENCE = 1.0
"""Seconds between two looks at what a worker has spent."""


class Timed(NamedTuple):
    """One run: seconds of processor and of the clock, and what it found."""

    cpu_s: float
    wall_s: float
    sample: Sample


def pin(core: int | None) -> int:
    """Binds this process and its children to one core, and returns it.

    Raises:
        ValueError: the machine lends this process no such core.
    """
    lent = os.sched_getaffinity(0)
    chosen = max(lent) if core is None else core
    if chosen not in lent:
        raise ValueError(f"no core {chosen}: this process may use {sorted(lent)}")
    os.sched_setaffinity(0, {chosen})
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    return chosen


class CandidateError(Exception):
    """A candidate raised; the message says what."""


class TooSlowError(CandidateError):
    """A candidate took more processor time than it may."""


class Worker:
    """A process that prepares a candidate, or several one after the other, and runs it on demand.

    Args:
        prepare: builds and compiles, from the arguments that come with each wish to prepare.
        limit: processor time that a wish may take, s.
    """

    def __init__(self, prepare: Callable[..., Run], limit: float = math.inf) -> None:
        self._limit = limit
        context = multiprocessing.get_context("spawn")
        self._here, there = context.Pipe()
        self._process = context.Process(target=_serve, args=(there, prepare), daemon=True)
        self._process.start()
        there.close()

    def __enter__(self) -> Worker:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._process.is_alive():
            self._process.terminate()
        self._process.join()

    def prepare(self, *arguments: object) -> float:
        """Builds and compiles; returns the seconds that took."""
        return float(self._ask("prepare", *arguments))

    def run(self) -> Timed:
        """Runs once."""
        return Timed(*self._ask("run"))

    @property
    def alive(self) -> bool:
        """Whether it may be asked for more."""
        return self._process.is_alive()

    def peak_mib(self) -> float:
        """Peak resident memory so far, MiB."""
        return float(self._ask("memory"))

    def _ask(self, *wish: object) -> Any:  # noqa: ANN401  (goes by the wish)
        try:
            self._here.send(wish)
            self._wait()
            good, answer = self._here.recv()
        except (EOFError, BrokenPipeError, ConnectionResetError):
            self._process.join()
            raise CandidateError(f"its process ended with code {self._process.exitcode}") from None
        if not good:
            raise CandidateError(answer)
        return answer

    def _wait(self) -> None:
        """Waits for an answer, as long as the wish may take."""
        process = psutil.Process(self._process.pid)
        start = sum(process.cpu_times()[:2])
        while not self._here.poll(_PATIENCE):
            try:
                spent = sum(process.cpu_times()[:2]) - start
            except psutil.NoSuchProcess:
                return
            if spent > self._limit:
                self._process.terminate()
                self._process.join()
                raise TooSlowError(f"took longer than {self._limit:g} s")


def _serve(pipe: Connection, prepare: Callable[..., Run]) -> None:
    """The worker's end: answers wishes until the other end closes."""
    run: Run | None = None
    while True:
        try:
            wish, *arguments = pipe.recv()
        except EOFError:
            return
        try:
            if wish == "memory":
                answer: Any = _peak_mib()
            elif wish == "prepare":
                start = time.perf_counter()
                run = prepare(*arguments)
                answer = time.perf_counter() - start
            else:
                assert run is not None
                answer = _timed(run)
        except Exception as error:  # noqa: BLE001  (whatever a candidate raises is its result)
            pipe.send((False, "".join(traceback.format_exception_only(error)).strip()))
        else:
            pipe.send((True, answer))


def _peak_mib() -> float:
    """Largest resident memory of this process; rusage would count its parent's before exec too."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    peak = next(line for line in status.splitlines() if line.startswith("VmHWM:"))
    return int(peak.split()[1]) / 1024


def _timed(run: Run) -> Timed:
    cpu, wall = time.process_time(), time.perf_counter()
    sample = run()
    return Timed(time.process_time() - cpu, time.perf_counter() - wall, sample)


def measure(
    benchmark: Benchmark, chosen: Sequence[Candidate], repeats: int, tell: Tell
) -> list[CandidateResult]:
    """Runs the chosen candidates in turn, A B C A B C, and compares them with the reference.

    Args:
        benchmark: the benchmark.
        chosen: its candidates that are to be measured now.
        repeats: rounds.
        tell: told of the progress, line by line.

    Raises:
        CandidateError: the reference could not be computed.
    """
    tell(f"{benchmark.name}: reference")
    with Worker(benchmark.reference) as worker:
        worker.prepare()
        reference = worker.run().sample.values
    with ExitStack() as stack:
        at_work = [AtWork(one, stack.enter_context(Worker(one.prepare))) for one in chosen]
        for one in at_work:
            tell(f"{benchmark.name}: compiling {one.candidate.name}")
            one.prepare()
        for round_ in range(repeats):
            for one in at_work:
                if one.wants(round_):
                    one.run()
                    tell(f"{benchmark.name}: round {round_ + 1} of {repeats}: {one.line()}")
        return [one.outcome(reference) for one in at_work]


class AtWork:
    """A candidate under measurement; the arguments go to the worker with the wish to prepare."""

    def __init__(self, candidate: Candidate, worker: Worker, *arguments: object) -> None:
        self.candidate = candidate
        self._worker = worker
        self._arguments = arguments
        self._compile_s = float("nan")
        self._runs: list[Timed] = []
        self._failure = ""

    @property
    def spent_s(self) -> float:
        """Processor time of the runs so far."""
        return sum(run.cpu_s for run in self._runs)

    def prepare(self) -> None:
        """Builds and compiles it."""
        try:
            self._compile_s = self._worker.prepare(*self._arguments)
        except CandidateError as failed:
            self._failure = str(failed)

    def wants(self, round_: int) -> bool:
        """Whether it runs in that round."""
        most = self.candidate.repeats if self.candidate.timed else 1
        return not self._failure and (most is None or round_ < most)

    def run(self) -> None:
        """Runs it once."""
        try:
            self._runs.append(self._worker.run())
        except CandidateError as failed:
            self._failure = str(failed)

    def line(self) -> str:
        """What came of the last run."""
        result = self._failure or f"{self._runs[-1].cpu_s:.3g} s"
        return f"{self.candidate.name}: {result}"

    def outcome(self, reference: Mapping[str, Floats]) -> CandidateResult:
        """Its figures."""
        name, note, share = self.candidate.name, self.candidate.note, self.candidate.share
        if self._failure or not self._runs:
            return CandidateResult(name, note, failure=self._failure or "was not run")
        timed = self.candidate.timed
        sample, runs = self._runs[-1].sample, self._runs if timed else []
        return CandidateResult(
            name=name,
            note=note,
            compile_s=self._compile_s if timed else float("nan"),
            cpu_s=tuple(run.cpu_s / share for run in runs),
            wall_s=tuple(run.wall_s / share for run in runs),
            errors=errors(sample.values, reference),
            work=dict(sample.work),
            peak_mib=self._worker.peak_mib() if timed else float("nan"),
        )
