"""Refuses a folder in which another user has built: snakemake would end by a traceback there."""

import errno
import os
from pathlib import Path

from pipeline.runtime import UserError, refusal

KEPT = Path(".snakemake")
"""Holds what snakemake keeps of its runs, in their folder."""


def check(folder: Path) -> None:
    """Refuses a folder in which snakemake cannot keep what it does.

    Raises:
        UserError: it is another user's, or is protected.
    """
    kept = folder / KEPT
    _check(kept if kept.exists() else folder)
    for path in sorted(kept.glob("*")):
        _check(path)


def _check(path: Path) -> None:
    if os.access(path, os.W_OK) or not path.exists():  # a link to nothing
        return
    if path.stat().st_uid == os.getuid():
        raise refusal(path, PermissionError(errno.EACCES, "protected"))
    what = f"another user ({_owner(path)}) works in this folder"
    raise UserError(what, file=path, remedy="work in a clone of your own")


def _owner(path: Path) -> str:
    """Names the user that a file belongs to, by number where the machine knows no name."""
    try:
        return path.owner()
    except KeyError:
        return str(path.stat().st_uid)
