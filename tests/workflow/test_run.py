import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from pipeline.runtime import RUN_MARK
from tests.e2e.checkout import Checkout, wait_until
from tests.workflow.conftest import Sandbox

DESIGN, OTHER = "results/fig2/design.nc", "results/fig4/design.nc"


def jobs(root: Path) -> list[psutil.Process]:
    return Checkout(root).jobs()


def _is_of(run: subprocess.Popen[str], job: psutil.Process) -> bool:
    return f":{run.pid} on " in job.environ()[RUN_MARK]


def start(sandbox: Sandbox, target: str, more: int = 0) -> subprocess.Popen[str]:
    """Starts the design of a study and waits until its first jobs, and `more`, are at work."""
    run = subprocess.Popen(
        [sys.executable, "-m", "pipeline", "run", target],
        cwd=sandbox.root,
        env=sandbox.environment(),
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    wait_until(lambda: len(jobs(sandbox.root)) >= 2 + more, run, pause=0.05)
    return run


@pytest.mark.slow
def test_run_goes_on_after_a_kill_beside_another_study(sandbox: Sandbox) -> None:
    """Left-over jobs end, those of a run that is at work on another study do not."""
    sandbox.stage_seconds = 60.0
    other = start(sandbox, OTHER, more=2)  # than the server and the first look
    run = start(sandbox, DESIGN, more=len(jobs(sandbox.root)))
    theirs, left = (
        [process for process in jobs(sandbox.root) if _is_of(each, process)]
        for each in (other, run)
    )
    run.kill()
    run.wait()
    sandbox.stage_seconds = 0.0
    ended = sandbox.resume(DESIGN)
    assert ended.returncode == 0, ended.stderr
    assert not psutil.wait_procs(left, timeout=0)[1]
    assert "Nothing to be done" in sandbox.run(DESIGN).stderr
    assert all(process.is_running() for process in theirs)
    os.killpg(other.pid, signal.SIGINT)
    assert other.wait() != 0


def test_a_study_is_built_once_at_a_time_and_an_interrupt_leaves_no_job(sandbox: Sandbox) -> None:
    sandbox.stage_seconds = 60.0
    run = start(sandbox, DESIGN)
    at_work = f"another run is at work on fig2 (process {run.pid} on "
    for refused in (sandbox.resume(DESIGN), sandbox.run("fig2")):
        assert refused.returncode != 0
        assert refused.stderr.count("error: ") == 1
        assert at_work in refused.stderr
    sandbox.stage_seconds = 0.0
    assert sandbox.resume(OTHER).returncode == 0
    assert len(jobs(sandbox.root)) >= 2
    os.killpg(run.pid, signal.SIGINT)
    assert run.wait() != 0
    assert not jobs(sandbox.root)
    assert sandbox.resume(DESIGN).returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("ignored", [False, True])
def test_an_interrupt_of_a_run_alone_ends_its_jobs(sandbox: Sandbox, ignored: bool) -> None:
    """As a scheduler or an editor sends it: its group may be a script's, which lives on."""
    sandbox.stage_seconds = 60.0
    before = signal.signal(signal.SIGINT, signal.SIG_IGN if ignored else signal.SIG_DFL)
    try:
        run = start(sandbox, DESIGN, more=2)  # than the server and the first look
    finally:
        signal.signal(signal.SIGINT, before)
    left = jobs(sandbox.root)
    run.send_signal(signal.SIGINT)
    told = run.communicate(timeout=40)[0]
    assert run.returncode != 0
    assert "Traceback" not in told
    assert not psutil.wait_procs(left, timeout=10)[1]
    sandbox.stage_seconds = 0.0
    assert sandbox.resume(DESIGN).returncode == 0


def test_without_a_server_stages_end_with_a_killed_run(
    sandbox: Sandbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    scratch = sandbox.root.with_name("scratch" * 20)  # longer than the name of a socket
    scratch.mkdir()
    monkeypatch.setenv("TMPDIR", str(scratch))
    sandbox.stage_seconds = 60.0
    run = start(sandbox, DESIGN)
    wait_until(lambda: all(job.num_threads() > 1 for job in jobs(sandbox.root)), run, pause=0.05)
    left = jobs(sandbox.root)
    run.kill()
    assert "stages start one by one" in run.communicate()[0]
    assert not psutil.wait_procs(left, timeout=30)[1]


@pytest.mark.slow
def test_a_run_in_the_background_outlives_the_shell_that_began_it(sandbox: Sandbox) -> None:
    sandbox.stage_seconds = 60.0
    environment = sandbox.environment()
    environment.pop("MAKELEVEL", None)  # with which a run ends with its `make`
    shell = subprocess.Popen(
        ["sh", "-c", f"'{sys.executable}' -m pipeline run {DESIGN} & read line"],
        cwd=sandbox.root,
        env=environment,
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    wait_until(lambda: len(jobs(sandbox.root)) >= 2, shell, pause=0.05)
    (run,) = psutil.Process(shell.pid).children()
    shell.kill()
    shell.wait()
    time.sleep(0.5)
    assert run.status() != psutil.STATUS_ZOMBIE  # of which its new parent has not heard
    left = [run, *jobs(sandbox.root)]
    for process in left:
        process.terminate()
    psutil.wait_procs(left, timeout=5.0)
