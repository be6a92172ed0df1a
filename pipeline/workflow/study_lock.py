"""Locks what a run builds, study by study, so that several runs work side by side in one folder.

The kernel holds a lock for the process that took it and drops it with that process, however it
ends: none is ever left over. Snakemake's own, which a kill leaves behind, are off (profiles).
"""

import errno
import fcntl
import logging
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TextIO

from pipeline.runtime import UserError, refusal

LOG = logging.getLogger(__name__)

FOLDER = Path(".snakemake/studies")
"""Holds a lock file for each study, which names the process that took it last."""

_WITHOUT_LOCKS = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP)
"""Errors of file systems that know no locks, as some of clusters."""

_held: list[TextIO] = []


def hold(outputs: Iterable[str]) -> None:
    """Locks the studies that files are of (results/STUDY/...), until this process ends.

    Raises:
        UserError: another process builds one of them, or the machine refuses a file for a lock.
    """
    for study in sorted({Path(output).parts[1] for output in outputs}):
        try:
            FOLDER.mkdir(parents=True, exist_ok=True)
            _lock(study)
        except OSError as error:
            if error.errno not in _WITHOUT_LOCKS:
                raise refusal(FOLDER / study, error) from error
            LOG.warning("no locks on this file system: begin one run of a study at a time")
            return


def _lock(study: str) -> None:
    file = (FOLDER / study).open("a+", encoding="utf-8")
    _held.append(file)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        file.seek(0)
        holder = file.read()
        what = f"another run is at work on {study} (process {holder})"
        remedy = f"wait for it, or end it with: kill -INT {holder}"
        raise UserError(what, file=FOLDER / study, remedy=remedy) from error
    file.truncate(0)
    print(os.getpid(), end="", file=file, flush=True)
