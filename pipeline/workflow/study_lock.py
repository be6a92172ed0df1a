"""Locks what a run builds, study by study, so that several runs work side by side in one folder.

The kernel holds a lock for the process that took it and drops it with that process, however it
ends: none is ever left over. Snakemake's own, which a kill leaves behind, are off (profiles).
"""

import fcntl
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TextIO

from pipeline.runtime import UserError

FOLDER = Path(".snakemake/studies")
"""Holds a lock file for each study, which names the process that took it last."""

_held: list[TextIO] = []


def hold(outputs: Iterable[str]) -> None:
    """Locks the studies that files are of (results/STUDY/...), until this process ends.

    Raises:
        UserError: another process builds one of them.
    """
    FOLDER.mkdir(parents=True, exist_ok=True)
    for study in sorted({Path(output).parts[1] for output in outputs}):
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
