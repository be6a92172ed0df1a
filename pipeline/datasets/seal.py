"""Seals datasets: a SHA-256 of all of a file's bytes, behind them, so that no damage is read.

HDF5 ends where its own header says, and minds nothing that follows: any software reads a sealed
file. One that was changed by other software has lost its seal.
"""

import errno
import hashlib
from pathlib import Path
from typing import BinaryIO, Literal

ATTRIBUTE = "seal"
DESCRIPTION = "SHA-256 of the file, in its last 32 bytes"
_MARK = b"metacloak.sha256"
_LENGTH = len(_MARK) + hashlib.sha256().digest_size
_PIECE = 1 << 20

State = Literal["whole", "broken", "absent"]


def write_seal(path: Path) -> None:
    """Seals a file."""
    with path.open("r+b") as file:
        size = file.seek(0, 2)
        file.write(_MARK + _digest(file, size))


def check_seal(path: Path) -> State:
    """Checks the seal of a file against its bytes.

    Raises:
        OSError: the file cannot be read.
    """
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "not a plain file", str(path))
    with path.open("rb") as file:
        size = file.seek(0, 2) - _LENGTH
        if size < 0:
            return "absent"
        file.seek(size)
        end = file.read(_LENGTH)
        if not end.startswith(_MARK):
            return "absent"
        return "whole" if end == _MARK + _digest(file, size) else "broken"


def _digest(file: BinaryIO, size: int) -> bytes:
    """Hashes the first bytes of a file by SHA-256, and leaves it behind them."""
    found = hashlib.sha256()
    file.seek(0)
    while size > 0:
        piece = file.read(min(size, _PIECE))
        if not piece:
            break
        found.update(piece)
        size -= len(piece)
    return found.digest()
