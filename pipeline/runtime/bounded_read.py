"""Reads files that others wrote, up to a bound."""

import errno
import stat
from pathlib import Path

UNREADABLE = (OSError, RuntimeError, ValueError, TypeError, LookupError, AttributeError)
"""Errors that xarray and its libraries raise for files that are not as they should be."""


def read_bounded(path: Path, most: int) -> bytes:
    """Reads the bytes of a file that has at most so many.

    Raises:
        OSError: it cannot be read, is larger, or is a device or a pipe, which need not end.
    """
    check_size(path, most)
    return path.read_bytes()


def check_size(path: Path, most: int) -> None:
    """Refuses a file of more than so many bytes.

    Raises:
        OSError: it is not there, is larger, or is a device or a pipe, which need not end.
    """
    entry = path.stat()
    if not (stat.S_ISREG(entry.st_mode) or stat.S_ISDIR(entry.st_mode)):
        raise OSError(errno.EINVAL, "not a plain file", str(path))
    if entry.st_size > most:
        what = f"{entry.st_size} bytes, which is more than {most}"
        raise OSError(errno.EINVAL, what, str(path))
