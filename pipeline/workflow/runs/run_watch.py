"""Ends jobs of a run that was killed, where no server of stages does."""

import os
import signal
import threading
import time

from pipeline.runtime import RUN_MARK, cli
from pipeline.workflow.runs.live_runs import Run

_PAUSE = 1.0  # seconds


def end_with_run() -> None:
    """Has this process, a job, end soon after its run: one that is killed tells its jobs nothing.

    The run is the one that the environment names: a shell between the two lives on. A process that
    no run began, or one on another host, is left alone.
    """
    run = Run.parse(os.environ.get(RUN_MARK, "").rpartition(":")[2])
    if run is not None and run.here and run.may_live:
        threading.Thread(target=_end_after, args=(run,), daemon=True).start()


def _end_after(run: Run) -> None:
    while run.may_live:
        time.sleep(_PAUSE)
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(cli.GRACE)
    os.kill(os.getpid(), signal.SIGKILL)
