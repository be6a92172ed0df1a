"""Runs methods in processes of their own, bound to one core."""

import math
import multiprocessing
import os
import time
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import psutil

from benchmarks.harness.records import Run, Sample
from pipeline.runtime import UserError

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_PATIENCE = 1.0
"""Seconds between two looks at what a worker has spent."""


class Timed(NamedTuple):
    """Holds one run: seconds of processor and of the clock, and its results."""

    cpu_s: float
    wall_s: float
    sample: Sample


def pin(core: int | None) -> int:
    """Binds this process and its children to one core, and returns it.

    Raises:
        UserError: the machine lends this process no such core.
    """
    lent = os.sched_getaffinity(0)
    chosen = max(lent) if core is None else core
    if chosen not in lent:
        remedy = f"this process may use {sorted(lent)}"
        raise UserError(f"no core {chosen}", key="core", remedy=remedy)
    os.sched_setaffinity(0, {chosen})
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    return chosen


class CandidateError(Exception):
    """Reports that a method raised; the message says what."""


class TooSlowError(CandidateError):
    """Reports that a method took more processor time than it may."""


class Worker:
    """Prepares a method, or several one after the other, in a process, and runs it on demand.

    `prepare` takes the arguments of each wish to prepare; `limit` bounds a wish's processor time,
    s.
    """

    def __init__(self, prepare: Callable[..., Run], limit: float = math.inf) -> None:
        self._limit = limit
        context = multiprocessing.get_context("spawn")
        self._here, there = context.Pipe()
        self._process = context.Process(target=_serve, args=(there, prepare), daemon=True)
        self._process.start()
        there.close()

    def __enter__(self) -> "Worker":
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
        """Tests whether it may be asked for more."""
        return self._process.is_alive()

    def peak_mib(self) -> float:
        """Returns the peak resident memory so far, MiB."""
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
    """Answers wishes at the worker's end until the other end closes."""
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
    """Returns the largest resident memory; rusage would count the parent's before exec too."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    peak = next(line for line in status.splitlines() if line.startswith("VmHWM:"))
    return int(peak.split()[1]) / 1024


def _timed(run: Run) -> Timed:
    cpu, wall = time.process_time(), time.perf_counter()
    sample = run()
    return Timed(time.process_time() - cpu, time.perf_counter() - wall, sample)
