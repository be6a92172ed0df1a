"""The workflow on a real SLURM of one node: a submitter killed, a node lost, the same bytes."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from pipeline.environment import ROOT
from pipeline.leftovers import PREFIX
from tests.e2e.checkout import Checkout

TARGET = "fig3@quick"
AS_ROOT = () if os.geteuid() == 0 else ("sudo", "-n")
PATIENCE = 900.0  # seconds; far more than it takes, for a machine that others use as well
ON_SLURM = (
    *("--profile", "profiles/slurm", "--slurm-no-account"),
    *("--slurm-status-command", "squeue", "--slurm-init-seconds-before-status-checks", "2"),
    *("--latency-wait", "5"),
)


@dataclass(frozen=True)
class Job:
    """A job as `squeue` tells of it."""

    number: str
    state: str
    name: str
    folder: str
    memory: str
    cores: str
    limit: str
    comment: str


def asked(*command: str) -> str:
    return subprocess.run(command, text=True, capture_output=True, check=True).stdout


def jobs(folder: Path, state: str = "") -> list[Job]:
    """The jobs of a folder that wait or run."""
    listed = asked("squeue", "--noheader", "--format=%i|%T|%j|%Z|%m|%C|%l|%k").splitlines()
    found = [Job(*line.split("|")) for line in listed]
    return [job for job in found if job.folder == str(folder) and state in job.state]


def designing(folder: Path) -> list[Job]:
    return [job for job in jobs(folder, "RUNNING") if job.comment.startswith("rule_design")]


def wait_for(condition: Callable[[], object], run: subprocess.Popen[str]) -> None:
    until = time.monotonic() + PATIENCE
    while not condition():
        assert run.poll() is None, f"ended before: {run.communicate()[0]}"
        assert time.monotonic() < until, "it did not come"
        time.sleep(0.1)


@contextmanager
def started(checkout: Checkout) -> Iterator[subprocess.Popen[str]]:
    """The command of a user; whatever comes, it ends with the block; its jobs do not."""
    run = subprocess.Popen(
        [sys.executable, "-m", "pipeline.run", *ON_SLURM, TARGET],
        cwd=checkout.root,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    try:
        yield run
    finally:
        if run.poll() is None:
            os.killpg(run.pid, signal.SIGKILL)
            run.communicate()


@pytest.fixture(scope="module")
def local(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A checkout in which the figure was built without a cluster."""
    checkout = Checkout.made(tmp_path_factory.mktemp("local") / "checkout")
    checkout.take_kernels(ROOT)
    ended = checkout.make(TARGET)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return checkout


def lose_the_node(checkout: Checkout) -> None:
    """The node goes with all that runs on it, and is brought back."""
    node = socket.gethostname().partition(".")[0]
    asked(*AS_ROOT, "scontrol", "update", f"nodename={node}", "state=down", "reason=test")
    for process in checkout.stages("pipeline.design"):
        process.kill()
    asked(*AS_ROOT, "scontrol", "update", f"nodename={node}", "state=resume")


def test_whatever_is_lost_the_results_are_those_of_one_machine(
    local: Checkout, tmp_path: Path
) -> None:
    checkout = local.copied(tmp_path / "checkout")
    checkout.take_kernels(ROOT)

    with started(checkout) as run:
        wait_for(lambda: designing(checkout.root), run)
        for job in designing(checkout.root):
            assert (job.memory, job.cores, job.limit) == ("4000M", "1", "8:00:00")
            assert job.name.startswith(PREFIX)
    left = {job.number for job in jobs(checkout.root)}
    assert left, "the jobs live on without their submitter"

    with started(checkout) as run:
        wait_for(lambda: {job.number for job in designing(checkout.root)} - left, run)
        assert not left & {job.number for job in jobs(checkout.root)}
        lose_the_node(checkout)
        told = run.communicate(timeout=PATIENCE)[0]
    assert run.returncode == 0, told
    assert all(f"cancelled job {number} of a killed run" in told for number in left)
    assert "node failure" in told
    assert not jobs(checkout.root)
    for study in (TARGET, f"{TARGET}.1", f"{TARGET}.2"):
        assert checkout.built(study) == local.built(study)
        assert local.built(study)
