"""Writes files and folders that appear complete or not at all."""

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil

from pipeline.runtime.errors import UserError, refusal

_HEAD_BYTES = 4096  # bytes of a file that hold the words by which its writer knows it


def sidecar_path(
    out: Path, *sources: Path, ending: str, is_own: Callable[[Path], bool], key: str = "--out"
) -> Path:
    """Names the file beside a result, which replaces none but one that the same stage wrote.

    Args:
        out: the result.
        sources: what it is made of.
        ending: of the file's name, after the result's stem.
        is_own: tells whether the stage wrote a file that is there.
        key: the option that chooses the place.

    Raises:
        UserError: it would replace the result, a source or somebody's file.
    """
    path = out.with_name(out.stem + ending)
    same = any(path.resolve() == held.resolve() for held in (out, *sources))
    if same or (path.exists() and not is_own(path)):
        what = "this file would be written over" + ("" if same else ", which this did not make")
        remedy = f"give the result another name or folder; {path.name} is put beside it"
        raise UserError(what, file=path, key=key, value=str(out), remedy=remedy)
    return path


def begins_with(words: str) -> Callable[[Path], bool]:
    """Makes a test of whether a file holds words near its beginning.

    Raises:
        UserError: by the test, of a file that cannot be read.
    """

    def test(path: Path) -> bool:
        try:
            with path.open("rb") as file:
                return words.encode() in file.read(_HEAD_BYTES)
        except OSError as error:
            raise refusal(path, error) from error

    return test


@contextmanager
def write_atomically(path: Path) -> Iterator[Path]:
    """Yields a path beside ``path`` to write to, which takes its place at the end, or vanishes.

    It is this process's own, so that two that write the same file do not meet half of each other's.

    Raises:
        UserError: the folder is full, read-only or not ours.
    """
    aside = path.with_name(f".part_{os.getpid()}_{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove_leftovers(path)
        yield aside
        sync(aside)
        aside.replace(path)
        sync(path.parent)
    except OSError as error:
        raise refusal(path, error) from error
    finally:
        _discard(aside)


@contextmanager
def write_folder_atomically(folder: Path) -> Iterator[Path]:
    """Yields a new folder that takes the place of ``folder`` at the end, or vanishes on an error.

    Raises:
        UserError: the disk is full, read-only or not ours.
    """
    aside = folder.with_name(f".{folder.name}.part")
    former = folder.with_name(f".{folder.name}.former")
    try:
        for old in (aside, former):
            shutil.rmtree(old, ignore_errors=True)
        aside.mkdir(parents=True)
        yield aside
        if folder.exists():
            folder.rename(former)
        aside.rename(folder)
    except OSError as error:
        raise refusal(error.filename or folder, error) from error
    finally:
        shutil.rmtree(aside, ignore_errors=True)
        shutil.rmtree(former, ignore_errors=True)


def sync(path: Path) -> None:
    """Waits until the content of a file, or the names in a folder, are safe on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _remove_leftovers(path: Path) -> None:
    """Removes what a process that was killed left of the file."""
    name = path.name.replace("[", "[[]")  # a pattern that matches the name alone
    for left in path.parent.glob(f".part_*_{name}"):
        number = left.name.split("_")[1]
        if not (number.isdecimal() and psutil.pid_exists(int(number))):
            _discard(left)


def _discard(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError:
        return  # the error that matters is the one already on its way
