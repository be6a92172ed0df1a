"""Makes a folder for temporary files that can be trusted as much as the user's home."""

import os
import stat
import tempfile
from pathlib import Path

TEMPORARY_NAME = f"metacloak-{os.getuid()}"


def make_temporary_folder() -> Path:
    """Makes a folder that only this user can write: what lies there is run.

    Raises:
        OSError: it cannot be made, or others may have written there.
    """
    folder = Path(tempfile.gettempdir(), TEMPORARY_NAME)
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
        raise PermissionError(f"others can write {folder}")
    return folder
