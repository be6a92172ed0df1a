"""Files that others wrote, read whole, but not without bound."""

from __future__ import annotations

import errno
import stat
from pathlib import Path


def read_bounded(path: Path, most: int) -> bytes:
    """The bytes of a file that has at most so many.

    Raises:
        OSError: it cannot be read, is larger, or is a device or a pipe, which need not end.
    """
    told = path.stat()
    if not (stat.S_ISREG(told.st_mode) or stat.S_ISDIR(told.st_mode)):
        raise OSError(errno.EINVAL, "not a plain file", str(path))
    if told.st_size > most:
        what = f"{told.st_size} bytes, which is more than {most}"
        raise OSError(errno.EINVAL, what, str(path))
    return path.read_bytes()
