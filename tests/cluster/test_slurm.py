"""Figure 3 on a real SLURM of one node: a node lost, the submitter killed, the same bytes."""

import os
import re
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest

from pipeline.workflow.runs.stale_jobs import PREFIX
from tests.e2e.checkout import Checkout, wait_until

TARGET = "fig3@quick"
STUDIES = (TARGET, f"{TARGET}.1", f"{TARGET}.2")
LASTING = 16  # evaluations, so that an optimisation is still at work when it is to be disturbed
AS_ROOT = () if os.geteuid() == 0 else ("sudo", "-n")
PATIENCE = 600.0  # seconds; far more than it takes, for a machine that others use as well
PAUSE = 0.2  # seconds between two looks at the cluster
# Snakemake looks after its jobs once in so many seconds, and in ten more each time that none has
# ended: long enough for a job of these to end, and no longer.
INTERVAL = 9
SUBMIT = (
    *(".venv/bin/python", "-m", "pipeline", "run"),
    *("--profile", "profiles/slurm", "--slurm-no-account", "--latency-wait", "5"),
    *("--slurm-status-command", "squeue"),
    *("--slurm-init-seconds-before-status-checks", str(INTERVAL), TARGET),
)
ASKED = {
    "design": ("4000M", "1", "8:00:00"),
    "simulate": ("4000M", "1", "1:00:00"),
    "family_report": ("2000M", "1", "30:00"),
}
"""Memory, cores and time of the jobs of each rule; the others run where the submitter does."""


@pytest.fixture(scope="module")
def cluster() -> Iterator[None]:
    """This machine, as a cluster of one node."""
    scripts = Path(__file__).parent
    try:
        subprocess.run([scripts / "start.sh"], check=True)
        yield
    finally:
        subprocess.run([scripts / "stop.sh"], check=True)


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

    @property
    def rule(self) -> str:
        return re.sub("^rule_|_wildcards_.*$", "", self.comment)


def asked(*command: str) -> str:
    return subprocess.run(command, text=True, capture_output=True, check=True).stdout


def jobs(checkout: Checkout, *states: str) -> list[Job]:
    """All jobs of a checkout, or those in some states."""
    listed = asked("squeue", "--noheader", "--states=all", "--format=%i|%T|%j|%Z|%m|%C|%l|%k")
    found = [Job(*line.split("|")) for line in listed.splitlines()]
    mine = [job for job in found if job.folder == str(checkout.root)]
    return [job for job in mine if not states or job.state in states]


def numbers(found: list[Job]) -> set[str]:
    return {job.number for job in found}


def journals(checkout: Checkout) -> dict[str, bytes]:
    """What the optimisations have kept of their evaluations."""
    paths = checkout.root.glob(f"results/{TARGET}.*/.journal/*/*.journal")
    return {path.relative_to(checkout.root).as_posix(): path.read_bytes() for path in paths}


@contextmanager
def begun(checkout: Checkout, *command: str) -> Iterator[subprocess.Popen[str]]:
    """A command of a user, killed with the end of the block unless it has ended."""
    run = checkout.begin(*command)
    try:
        yield run
    finally:
        if run.poll() is None:
            os.killpg(run.pid, signal.SIGKILL)


def made(root: Path) -> Checkout:
    """A checkout in which nothing is built."""
    checkout = Checkout.made(root)
    checkout.edit("evaluations: 6\n", f"evaluations: {LASTING}\n", "fig3")
    return checkout


def lose_the_node(checkout: Checkout) -> None:
    """The node goes with all that runs on it, and is brought back."""
    node = f"nodename={socket.gethostname().partition('.')[0]}"
    asked(*AS_ROOT, "scontrol", "update", node, "state=down", "reason=test")
    for process in checkout.jobs():
        if on_a_node(process):
            process.kill()
    asked(*AS_ROOT, "scontrol", "update", node, "state=resume")


def on_a_node(process: psutil.Process) -> bool:
    try:
        return "SLURM_JOB_ID" in process.environ()
    except psutil.Error:  # it has just ended
        return False


@pytest.mark.usefixtures("cluster")
def test_whatever_is_lost_the_results_are_those_of_one_machine(tmp_path: Path) -> None:
    alone = made(tmp_path / "alone")
    checkout = alone.copied(tmp_path / "checkout")
    with begun(alone, ".venv/bin/snakemake", TARGET) as building:
        lost, left = disturb(checkout)
        with begun(checkout, *SUBMIT) as run:
            told = run.communicate(timeout=PATIENCE)[0]
        assert run.returncode == 0, told
        assert set(re.findall(r"cancelled job (\d+) of a killed run", told)) == left
        told = building.communicate()[0]
        assert building.returncode == 0, told

    found = jobs(checkout)
    assert numbers(jobs(checkout, "NODE_FAIL")) == lost
    assert numbers(jobs(checkout, "CANCELLED")) == left
    assert {job.state for job in found} == {"NODE_FAIL", "CANCELLED", "COMPLETED"}
    assert {job.rule: (job.memory, job.cores, job.limit) for job in found} == ASKED
    assert all(job.name.startswith(PREFIX) for job in found)
    for study in STUDIES:
        assert alone.built(study)
        assert checkout.built(study) == alone.built(study)
    assert journals(checkout) == journals(alone), "evaluations were lost or written twice"


def disturb(checkout: Checkout) -> tuple[set[str], set[str]]:
    """Loses the node under the jobs of a run, then the submitter once it has given them again.

    Returns:
        The jobs that were lost with the node, and those that the submitter left.
    """
    with begun(checkout, *SUBMIT) as run:
        wait_until(lambda: len(journals(checkout)) == 2, run, PAUSE)
        lost = numbers(jobs(checkout, "RUNNING"))
        lose_the_node(checkout)
        wait_until(lambda: numbers(jobs(checkout, "RUNNING")) - lost, run, PAUSE)
    told = run.communicate()[0]
    assert "node failure" in told, told
    return lost, numbers(jobs(checkout, "PENDING", "RUNNING"))
