"""Whatever ends `make`, the same command goes on, and ends with the same bytes."""

import os
import signal
import struct
import subprocess
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import pytest

from tests.e2e.checkout import Checkout, assert_plain, wait_until

HEADER = struct.Struct("<4sQI")
METHODS = ("sqp", "mma")

Run = subprocess.Popen[str]
Moment = Callable[[Checkout, int], bool]
"""Tells of a checkout, and the length of its journal before the run, whether to end it."""


def records(journal: Path) -> list[bytes]:
    """The whole records of a journal; the first one is its key."""
    content, found = journal.read_bytes(), []
    while len(content) >= HEADER.size:
        _, length, _ = HEADER.unpack(content[: HEADER.size])
        if len(content) < HEADER.size + length:
            break
        found.append(content[: HEADER.size + length])
        content = content[HEADER.size + length :]
    return found


def journal(checkout: Checkout, method: str) -> list[bytes]:
    """Records of a method's journal; none as long as there is no such file."""
    return [
        record
        for path in checkout.results.glob(f".journal/*/{method}.journal")
        for record in records(path)
    ]


def kill_everything(run: Run, checkout: Checkout) -> None:
    """As the end of a session, a container or the power does."""
    del checkout
    os.killpg(run.pid, signal.SIGKILL)
    run.communicate()


def kill_make(run: Run, checkout: Checkout) -> None:
    """The stages live on for a while."""
    del checkout
    run.kill()
    run.wait()


def kill_stage(run: Run, checkout: Checkout) -> None:
    """As the kernel does when memory runs out."""
    stages = checkout.stages("design")
    for stage in stages:
        stage.kill()
    told = run.communicate()[0]
    assert stages
    assert run.returncode != 0
    assert "Error in rule design" in told
    assert "Traceback" not in told
    assert_plain(told)


def press_ctrl_c(run: Run, checkout: Checkout) -> None:
    os.killpg(run.pid, signal.SIGINT)
    told = run.communicate(timeout=60)[0]
    assert run.returncode != 0
    assert "interrupted: run the same command again to finish" in told
    assert told.splitlines()[-1].startswith("make: ***")
    assert "Traceback" not in told
    assert_plain(told)
    assert not checkout.jobs()


def evaluated(count: int) -> Moment:
    return lambda checkout, known: len(journal(checkout, "sqp")) > known + count


def there_is(*patterns: str) -> Moment:
    return lambda checkout, _: any(list(checkout.results.glob(pattern)) for pattern in patterns)


ENDS: dict[str, tuple[Moment, Callable[[Run, Checkout], None]]] = {
    "early in an optimisation": (evaluated(2), kill_stage),
    "later in it": (evaluated(2), press_ctrl_c),
    "while a design is written": (there_is(".part_*_design_*.nc"), kill_everything),
    "while it is simulated": (there_is("logs/simulate.log", "logs/sweep_*.log"), kill_make),
    "while the report is drawn": (there_is("logs/report.log"), kill_everything),
}


def check_ends(moments: Iterable[str], undisturbed: Checkout, fresh: Checkout) -> None:
    """Ends a build at each of these moments, and compares what comes of it."""
    for moment in moments:
        has_come, end = ENDS[moment]
        before = {method: journal(fresh, method) for method in METHODS}
        run = fresh.start()
        wait_until(partial(has_come, fresh, len(before["sqp"])), run)
        end(run, fresh)
        for method, known in before.items():
            assert journal(fresh, method)[: len(known)] == known, f"{moment}: evaluations lost"
    ended = fresh.make()
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert fresh.built() == undisturbed.built()
    for method in METHODS:
        assert journal(fresh, method) == journal(undisturbed, method)
    assert not list(fresh.results.glob("**/.part_*"))
    assert not fresh.jobs()


@pytest.mark.slow
def test_a_second_run_in_the_same_folder_is_refused(fresh: Checkout) -> None:
    """Stopped, the first run holds its study however long the second takes to begin."""
    run = fresh.start()
    wait_until((fresh.results / "logs/design_sqp.log").exists, run)
    os.killpg(run.pid, signal.SIGSTOP)
    ended = fresh.make()
    assert ended.returncode != 0
    assert "another run is at work on tiny" in ended.stderr
    assert "remedy:" in ended.stderr
    assert run.poll() is None
    kill_everything(run, fresh)
