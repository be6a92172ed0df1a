"""The workflow goes on after any kind of end."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil

from pipeline.runtime import RUN_MARK
from tests.workflow.conftest import Sandbox


def wait_for(condition: Callable[[], bool], seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)


def jobs(root: Path) -> list[psutil.Process]:
    """The running jobs of the workflow in a folder."""
    found = []
    for process in psutil.process_iter():
        try:
            if process.environ().get(RUN_MARK) == str(root):
                found.append(process)
        except psutil.Error:
            continue
    return found


DESIGN = "results/fig2/design.nc"


def start(sandbox: Sandbox) -> subprocess.Popen[bytes]:
    """Starts the design of a study and waits until its first jobs are at work."""
    run = subprocess.Popen(
        [sys.executable, "-m", "pipeline", "run", DESIGN],
        cwd=sandbox.root,
        env=sandbox.environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    wait_for(lambda: len(jobs(sandbox.root)) >= 2)
    return run


def test_run_goes_on_after_a_kill(sandbox: Sandbox) -> None:
    sandbox.stage_seconds = 60.0
    run = start(sandbox)
    left = jobs(sandbox.root)
    run.kill()
    run.wait()
    assert any((sandbox.root / ".snakemake/locks").iterdir())
    sandbox.stage_seconds = 0.0
    ended = sandbox.resume(DESIGN)
    assert ended.returncode == 0, ended.stderr
    assert not psutil.wait_procs(left, timeout=0)[1]
    assert "Nothing to be done" in sandbox.run(DESIGN).stderr


def test_a_second_run_is_refused_and_an_interrupt_leaves_neither_lock_nor_jobs(
    sandbox: Sandbox,
) -> None:
    sandbox.stage_seconds = 60.0
    run = start(sandbox)
    ended = sandbox.resume(DESIGN)
    assert ended.returncode != 0
    assert f"already at work in this folder (process {run.pid})" in ended.stderr
    assert len(jobs(sandbox.root)) >= 2
    os.killpg(run.pid, signal.SIGINT)
    assert run.wait() != 0
    assert not jobs(sandbox.root)
    assert not list((sandbox.root / ".snakemake").glob("locks/*"))
