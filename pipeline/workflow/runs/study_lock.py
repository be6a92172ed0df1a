"""Locks what a run builds, study by study, so that several runs work side by side in one folder.

The kernel holds a lock for the process that took it and drops it with that process, however it
ends: none is ever left over. Snakemake's own, which a kill leaves behind, are off (profiles).
"""

import atexit
import errno
import fcntl
import logging
from collections.abc import Iterable
from pathlib import Path
from typing import TextIO

from pipeline.runtime import UserError, refusal
from pipeline.workflow.runs.live_runs import Run

LOG = logging.getLogger(__name__)

FOLDER = Path(".snakemake/studies")
"""Holds a lock file for each study, which names the run that took it until that run ends."""

_WITHOUT_LOCKS = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP)
"""Errors of file systems that know no locks, as some of clusters."""

_held: list[TextIO] = []


def hold(outputs: Iterable[str]) -> None:
    """Locks the studies that files are of (results/STUDY/...), until this process ends.

    Raises:
        UserError: another process builds one of them, or the machine refuses a file for a lock.
    """
    unlocked = False
    for study in sorted({Path(output).parts[1] for output in outputs}):
        try:
            FOLDER.mkdir(parents=True, exist_ok=True)
            unlocked |= not _hold(FOLDER / study)
        except OSError as error:
            raise refusal(FOLDER / study, error) from error
    if unlocked:
        LOG.warning("no locks on this file system: begin one run of a study at a time")
    atexit.register(_release)


def check_free(folder: Path) -> None:
    """Refuses a folder in which a run may be at work, on this host or on another one.

    Raises:
        UserError: a study is locked, or its file names a run that no lock tells to have ended.
    """
    for path in sorted((folder / FOLDER).glob("*")):
        try:
            with path.open("a+", encoding="utf-8") as file:
                locks = _lock(file, path)
                holder = _holder(file)
        except OSError as error:
            raise refusal(path, error) from error
        # a lock that another host holds is not seen on every file system
        if holder and holder.may_live and not (locks and holder.here):
            raise UserError(
                f"a run may be at work on {path.name} (process {holder})",
                file=path,
                remedy=f"{holder.remedy}; if it has ended, remove this file",
            )


def _hold(path: Path) -> bool:
    """Locks a study and names this run; returns whether the file system knows locks."""
    file = path.open("a+", encoding="utf-8")
    _held.append(file)
    locks = _lock(file, path)
    file.truncate(0)
    print(Run.own(), end="", file=file, flush=True)
    return locks


def _lock(file: TextIO, path: Path) -> bool:
    """Takes the lock of an open file; returns whether the file system knows locks.

    Raises:
        UserError: another process holds it.
    """
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        holder = _holder(file)
        what = f"another run is at work on {path.name}"
        if holder:
            what += f" (process {holder})"
        remedy = holder.remedy if holder else "wait for it"
        raise UserError(what, file=path, remedy=remedy) from error
    except OSError as error:
        if error.errno in _WITHOUT_LOCKS:
            return False
        raise
    return True


def _holder(file: TextIO) -> Run | None:
    """Reads which run has named itself in a lock file and not ended by itself since."""
    file.seek(0)
    return Run.parse(file.read())


def _release() -> None:
    """Takes the name of a run that ends by itself out of its lock files."""
    for file in _held:
        file.truncate(0)
