"""Starts snakemake so that it goes on after any kind of end.

A `kill -9` may leave jobs running, here or on a cluster. They are ended first, and snakemake then
continues what is incomplete. Runs that build other studies in the same folder are left alone.
"""

import ctypes
import os
import signal
import sys
from pathlib import Path
from typing import NoReturn

import psutil

from pipeline.runtime import INSTALLED, ROOT, RUN_MARK, WORK, UserError, streams
from pipeline.workflow import stale_jobs
from pipeline.workflow.rule_inputs import check_problems

_PATIENCE = 5.0  # seconds that a left-over job gets to end by itself
_PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of prctl(2)


def work(arguments: list[str]) -> NoReturn:
    """Checks the problem files of the targets, clears what a killed run left, runs snakemake."""
    streams.complete()
    os.chdir(WORK)
    check_problems(arguments)
    try:
        _clear_the_ground()
    except UserError as error:
        sys.exit(f"error: {error}")
    _end_with_make()
    snakemake = str(Path(sys.executable).with_name("snakemake"))
    os.execv(snakemake, [snakemake, *_places(), *arguments])


def _places() -> list[str]:
    """Options that name Snakefile and profile, where they are not in the folder of the work."""
    if not INSTALLED:
        return []
    places = {"--snakefile": ROOT / "Snakefile", "--workflow-profile": ROOT / "profiles/default"}
    return [str(word) for option in places.items() for word in option]


def _clear_the_ground() -> None:
    """Ends left-over jobs of killed runs.

    Raises:
        UserError: jobs on a cluster may be those of another run, or the cluster does not answer.
    """
    active = [process.pid for process in _others() if _is_snakemake(process)]
    if active and stale_jobs.remaining(WORK):
        raise UserError(
            f"jobs on the cluster may be those of the run at work here (process {active[0]})",
            file=WORK,
            remedy=f"wait for it, or end it with: kill -INT {active[0]}",
        )
    for number in stale_jobs.cancel(WORK):
        print(f"cancelled job {number} of a killed run", file=sys.stderr)  # noqa: T201
    runs = [f"{WORK}:{number}" for number in active]
    marks = {process: _mark(process) for process in _others()}
    orphans = [p for p, m in marks.items() if m.startswith(f"{WORK}:") and m not in runs]
    for process in orphans:
        process.terminate()
    _, stubborn = psutil.wait_procs(orphans, timeout=_PATIENCE)
    for process in stubborn:
        process.kill()


def _others() -> list[psutil.Process]:
    """Lists all processes but this one and those that started it."""
    this = psutil.Process()
    own = {this, *this.parents()}
    return [process for process in psutil.process_iter() if process not in own]


def _is_snakemake(process: psutil.Process) -> bool:
    try:
        names = {Path(word).name for word in process.cmdline()[:2]}
        return "snakemake" in names and Path(process.cwd()) == WORK
    except psutil.Error:
        return False


def _mark(process: psutil.Process) -> str:
    """Reads for which run a job works; empty if the process is no job or is not ours."""
    try:
        return process.environ().get(RUN_MARK, "")
    except psutil.Error:
        return ""


def _end_with_make() -> None:
    """Asks Linux to kill this process with the `make` that began it: it leaves no snakemake.

    A run that a shell left in the background outlives the shell.
    """
    if "MAKELEVEL" in os.environ and sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, signal.SIGKILL)
