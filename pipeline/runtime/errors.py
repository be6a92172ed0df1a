"""Defines the error that people read: what is wrong, where, and what to do about it."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike, fspath

_LONGEST_VALUE = 120
_CHOOSE = "choose a folder that can be written to"
_REFUSALS = {
    errno.ENOSPC: ("the disk is full", "free some space, then run the same command again"),
    errno.EDQUOT: ("the disk quota is used up", "free some space, then run the command again"),
    errno.EFBIG: ("the file would be too large", "raise the limit of file sizes (ulimit -f)"),
    errno.EROFS: ("the file system is read-only", _CHOOSE),
    errno.EACCES: ("no permission", f"check who may use it, or {_CHOOSE}"),
    errno.EPERM: ("no permission", f"check who may use it, or {_CHOOSE}"),
}


class UserError(Exception):
    """Reports a mistake in the input or a refusal by the machine, without a traceback.

    Args:
        what: the fault in one sentence.
        file: the file that holds it.
        line: its line, counted from one.
        key: the dotted key or the variable's name.
        value: the offending value as it was given.
        remedy: what to change, with an example where that helps.
    """

    def __init__(
        self,
        what: str,
        *,
        file: str | PathLike[str] | None = None,
        line: int | None = None,
        key: str | None = None,
        value: object = None,
        remedy: str | None = None,
    ) -> None:
        super().__init__(what)
        self.what = what
        self.file = None if file is None else fspath(file)
        self.line = line
        self.key = key
        self.value = value
        self.remedy = remedy

    def __str__(self) -> str:
        place = self.file
        if place is not None and self.line is not None:
            place = f"{place}, line {self.line}"
        rows = {
            "file": place,
            "key": self.key,
            "value": None if self.value is None else _shortened(repr(self.value)),
            "remedy": self.remedy,
        }
        told = [f"  {name + ':':<8}{text}" for name, text in rows.items() if text is not None]
        return "\n".join([self.what, *told])


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_VALUE else text[: _LONGEST_VALUE - 3] + "..."


def refusal(path: str | PathLike[str], error: OSError) -> UserError:
    """Explains, to the user, an error of the system about the file or folder `path`."""
    otherwise = (error.strerror or str(error), "check the path, then run the same command again")
    what, remedy = _REFUSALS.get(error.errno or 0, otherwise)
    return UserError(what, file=path, remedy=remedy)


@contextmanager
def found_in(path: PathLike[str]) -> Iterator[None]:
    """Names the file of mistakes that are raised without one."""
    try:
        yield
    except UserError as error:
        error.file = error.file or fspath(path)
        raise
