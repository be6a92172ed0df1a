"""Cancels jobs that a killed run left on a SLURM cluster: they would write into the next one."""

import subprocess
import time
from collections.abc import Collection
from pathlib import Path

from pipeline.runtime import UserError

PREFIX = "cloak_"
"""Begins the names of all jobs of a run; see profiles/slurm."""

LOGS = Path(".snakemake/slurm_logs")
"""Logs of jobs on a cluster, in the folder of their run: without it, there was none."""

_PATIENCE = 60.0  # seconds that cancelled jobs get to end
_FORMAT = "%i|%j|%Z"  # number, name, working directory


def cancel(folder: Path, numbers: Collection[str]) -> None:
    """Cancels jobs for a folder, and waits until none of them is left.

    Raises:
        UserError: SLURM does not answer, or a job does not end.
    """
    _ask("scancel", *numbers)
    until = time.monotonic() + _PATIENCE
    while left := [number for number in jobs(folder) if number in numbers]:
        if time.monotonic() > until:
            remedy = "wait for it, and run the same command again"
            raise UserError(f"job {left[0]} of a killed run does not end", remedy=remedy)
        time.sleep(0.5)


def remaining(folder: Path) -> list[str]:
    """Lists our jobs for a folder; asks SLURM only if there ever was a job on a cluster."""
    return jobs(folder) if (folder / LOGS).exists() else []


def jobs(folder: Path) -> list[str]:
    """Lists the numbers of our jobs for a folder, waiting or running."""
    rows = [line.split("|") for line in _ask("squeue", "--me", "--noheader", f"--format={_FORMAT}")]
    return [
        number for number, name, place in rows if name.startswith(PREFIX) and place == str(folder)
    ]


def _ask(*command: str) -> list[str]:
    try:
        ended = subprocess.run(command, text=True, capture_output=True, check=True, timeout=60)
    except (OSError, subprocess.SubprocessError) as error:
        told = str(getattr(error, "stderr", None) or error).strip()
        remedy = f"mend it, or remove {LOGS} if no job of this folder is left on the cluster"
        raise UserError(f"SLURM does not answer: {told}", remedy=remedy) from error
    return ended.stdout.splitlines()
