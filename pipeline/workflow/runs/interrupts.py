"""Ends the jobs of an interrupted run: snakemake waits for them, as Ctrl-C reaches them too."""

import signal
import threading
import time
from contextlib import suppress
from types import FrameType

import psutil

from pipeline.runtime import cli

_PATIENCE = 1.0  # seconds that jobs get to end by a Ctrl-C that reached them too


def end_jobs(spared: int | None = None) -> None:
    """Has an interrupt of this process alone end its jobs: all children but the one `spared`.

    Also where a script began the run in the background, with interrupts ignored: its stages, which
    get them anyway, do not ignore them either.
    """

    def interrupt(number: int, _: FrameType | None) -> None:
        signal.signal(number, signal.SIG_IGN)  # a second one would break off snakemake's own end
        threading.Thread(target=_end_jobs, args=(spared,), daemon=True).start()
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupt)


def _end_jobs(spared: int | None) -> None:
    """Signals jobs without waiting for any: snakemake has to get their exit codes."""
    for number, patience in ((signal.SIGTERM, _PATIENCE), (signal.SIGKILL, cli.GRACE)):
        time.sleep(patience)
        for job in _jobs(spared):
            with suppress(psutil.Error):
                job.send_signal(number)


def _jobs(spared: int | None) -> list[psutil.Process]:
    """Lists the children of this process but one, and theirs."""
    jobs = [child for child in psutil.Process().children() if child.pid != spared]
    for job in list(jobs):
        with suppress(psutil.Error):
            jobs += job.children(recursive=True)
    return jobs
