"""Shows how far a long job is: a bar on a terminal, sparse plain lines in a log or a pipe."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Callable
from datetime import timedelta
from types import TracebackType
from typing import TYPE_CHECKING, Self

from pipeline.runtime.environment import RUN_MARK
from sim.core import working_time

if TYPE_CHECKING:
    from tqdm import tqdm

LOG = logging.getLogger(__name__)

_SECONDS_BETWEEN_LINES = 10.0
_LINES_PER_JOB = 10


class Progress:
    """Counts the steps of a job and tells about them, with figures such as loss and violation.

    A resumed job has done `initial` steps before. Where more steps come than were expected, as of a
    video that holds more frames than it tells, their number is the total. A bar is drawn, by
    default, on a terminal if `pipeline.runtime.cli` may talk to it. The clock, in seconds, by
    default stands still while loops are compiled.
    """

    def __init__(
        self,
        total: int,
        label: str,
        *,
        initial: int = 0,
        bar: bool | None = None,
        clock: Callable[[], float] = working_time,
    ) -> None:
        self._total, self._label, self._done, self._initial = total, label, initial, initial
        self._clock = clock
        self._start = self._told_at = clock()
        self._told_share = self._fraction()
        self._bar = self._draw() if (_can_draw() if bar is None else bar) else None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.close()

    def update(self, steps: int = 1, **figures: float | str) -> None:
        """Count `steps` more and tell of them if it is time; `figures` are shown behind."""
        self._done += steps
        self._total = max(self._total, self._done)
        figures_text = {
            name: x if isinstance(x, str) else f"{x:.4g}" for name, x in figures.items()
        }
        if self._bar is not None:
            self._bar.total = self._total
            self._bar.set_postfix(figures_text, refresh=False)
            self._bar.update(steps)
        now, share = self._clock(), self._fraction()
        if share > self._told_share or now - self._told_at >= _SECONDS_BETWEEN_LINES:
            self._told_at, self._told_share = now, share
            LOG.info(self._line(now, figures_text), extra={"drawn": self._bar is not None})

    def _fraction(self) -> int:
        return self._done * _LINES_PER_JOB // max(self._total, 1)

    def _line(self, now: float, figures_text: dict[str, str]) -> str:
        spent = now - self._start
        fresh = max(self._done - self._initial, 1)
        left = spent / fresh * max(self._total - self._done, 0)
        figures = "".join(f", {name} {value}" for name, value in figures_text.items())
        times = f"{_duration(spent)} spent, {_duration(left)} left"
        return f"{self._label}: {self._done}/{self._total}, {times}{figures}"

    def _draw(self) -> tqdm:
        from tqdm import tqdm

        return tqdm(total=self._total, initial=self._initial, desc=self._label, dynamic_ncols=True)


def _can_draw() -> bool:
    # In a workflow, the bars of jobs that run side by side would overwrite each other.
    return LOG.isEnabledFor(logging.INFO) and sys.stderr.isatty() and RUN_MARK not in os.environ


def _duration(seconds: float) -> str:
    return str(timedelta(seconds=round(seconds)))
