"""Writes files and folders that appear complete or not at all."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil

from pipeline.runtime.errors import UserError, refusal


def sidecar_path(out: Path, *sources: Path, suffix: str = ".yaml") -> Path:
    """Names the file beside a result, which must be neither that nor one it is made of.

    Raises:
        UserError: it is.
    """
    path = out.with_suffix(suffix)
    for held in (out, *sources):
        if path.resolve() == held.resolve():
            what = "this file would be written over"
            remedy = f"give the result another name or folder; {path.name} is put beside it"
            raise UserError(what, file=held, key="--out", value=str(out), remedy=remedy)
    return path


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
        _clear(path)
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


def _clear(path: Path) -> None:
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
