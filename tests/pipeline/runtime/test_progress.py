import logging
from collections.abc import Callable, Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.runtime.progress import Progress


@pytest.fixture
def lines(caplog: pytest.LogCaptureFixture) -> Callable[[], list[str]]:
    caplog.set_level(logging.INFO, "pipeline.runtime.progress")
    return lambda: [record.getMessage() for record in caplog.records]


class Clock:
    """A clock that a test turns."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_plain_lines_come_each_tenth(lines: Callable[[], list[str]]) -> None:
    clock = Clock()
    with Progress(100, "design sqp", bar=False, clock=clock) as progress:
        for step in range(100):
            clock.now += 0.5
            progress.update(loss=1 / (step + 1), violation=0.0, state="fine")
    told = lines()
    assert len(told) == 10
    assert told[0] == (
        "design sqp: 10/100, 0:00:05 spent, 0:00:45 left, loss 0.1, violation 0, state fine"
    )
    assert told[-1].startswith("design sqp: 100/100, 0:00:50 spent, 0:00:00 left")


def test_slow_steps_are_told_every_ten_seconds(lines: Callable[[], list[str]]) -> None:
    clock = Clock()
    with Progress(1000, "slow", bar=False, clock=clock) as progress:
        for _ in range(30):
            clock.now += 2.0
            progress.update()
    assert len(lines()) == 6


def test_a_resumed_job_counts_only_its_own_time(lines: Callable[[], list[str]]) -> None:
    clock = Clock()
    with Progress(100, "again", initial=80, bar=False, clock=clock) as progress:
        clock.now = 10.0
        progress.update(10)
    assert lines() == ["again: 90/100, 0:00:10 spent, 0:00:10 left"]


def test_a_bar_is_drawn_on_request(capsys: pytest.CaptureFixture[str]) -> None:
    with Progress(4, "drawn", bar=True) as progress:
        for _ in range(4):
            progress.update(loss=0.25)
    assert "drawn" in capsys.readouterr().err


def test_no_more_steps_are_done_than_there_are(
    lines: Callable[[], list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    for bar in (False, True):
        with Progress(8, "frames", bar=bar) as progress:
            progress.update(9)
    assert lines()[0].startswith("frames: 9/9,")
    assert "9/9" in capsys.readouterr().err


@given(steps=st.lists(st.integers(0, 30), max_size=30), total=st.integers(0, 100))
def test_any_steps_are_taken(steps: list[int], total: int) -> None:
    ticks: Iterator[float] = iter(float(tick) for tick in range(10_000))
    with Progress(total, "any", bar=False, clock=lambda: next(ticks)) as progress:
        for step in steps:
            progress.update(step, loss=0.1)
