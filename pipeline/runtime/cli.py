"""Frames every command line: options, logs, and errors that people can read."""

import argparse
import atexit
import gc
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import FrameType, ModuleType
from typing import NoReturn

from pipeline.runtime import streams
from pipeline.runtime.errors import UserError, refusal
from pipeline.runtime.progress import Progress as progress  # noqa: N813  (reads as a verb at its callers)
from pipeline.runtime.stage_table import PROBLEM, Option, Stage, option

__all__ = ["command_line", "imported", "leave", "parser", "progress", "run"]

Work = Callable[[argparse.Namespace], None]

LOG = logging.getLogger(__name__)
_LOGGERS = ("sim", "pipeline", "reports", "metacloak", "__main__")

GRACE = 10
"""Seconds that a terminated process may take to put away what is half done."""

_PROGRAM = "python -m pipeline"
_COMMON = (
    option("--log", type=Path, metavar="FILE", help="also write messages to this file"),
    option("--quiet", action="store_true", help="print nothing but errors"),
)


def parser(command: str, description: str, *, study: bool = True) -> argparse.ArgumentParser:
    """Makes a command line (`python -m command`) with the options that all commands share.

    `study` tells whether it wants --problem and --preset.
    """
    return _make_parser(
        f"python -m {command}", description, (*(PROBLEM if study else ()), *_COMMON)
    )


def _make_parser(
    program: str, description: str, options: Iterable[Option]
) -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(
        prog=program,
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    _add(made, options)
    return made


def command_line(stage: Stage) -> argparse.ArgumentParser:
    """Makes the command line of a stage from its row of the table."""
    does = f"{stage.does[0].upper()}{stage.does[1:]}."
    study = PROBLEM if stage.unused is not None and not stage.parts else ()
    shared = (*study, *(() if stage.passes_on else _COMMON))
    made = _make_parser(f"{_PROGRAM} {stage.name}", f"{does}\n\n{stage.about}".strip(), shared)
    for name in stage.inputs:
        made.add_argument(f"--{name}", type=Path, required=True, metavar="NC", help="to read")
    _add(made, stage.options)
    if stage.threads:
        text = f"{stage.threads} simulated side by side"
        made.add_argument("--threads", type=int, default=1, help=text)
    if stage.parts:
        commands = made.add_subparsers(dest="command", required=True)
        for name, options in stage.parts.items():
            part = commands.add_parser(name, allow_abbrev=False)
            _add(part, options)
            for common in _COMMON:  # also after the command
                part.add_argument(
                    *common.names, **{**common.settings, "default": argparse.SUPPRESS}
                )
    return made


def _add(made: argparse.ArgumentParser, options: Iterable[Option]) -> None:
    for each in options:
        made.add_argument(*each.names, **each.settings)


def run(work: Work, made: argparse.ArgumentParser, argv: Sequence[str] | None = None) -> int:
    """Parses the command line, does the work, and reports errors in words.

    Returns:
        The exit code: 0 done, 2 a mistake in the input, 1 the machine refused or there is a bug,
        130 Ctrl-C; a SIGTERM exits with 143.
    """
    streams.complete()
    args = made.parse_args(argv)
    try:
        with _logging(args.log, quiet=args.quiet), _handle_termination():
            return _run_reported(work, args)
    except UserError as error:  # the log itself could not be written
        print(f"error: {error}", file=sys.stderr)  # noqa: T201
        return 2


def imported(name: str) -> ModuleType:
    """Imports a module with all that it needs: it stays, and is not looked through as garbage.

    Only the first time: what a process made since then would never be freed.
    """
    if name in sys.modules:
        return sys.modules[name]
    gc.disable()
    try:
        return import_module(name)
    finally:
        gc.freeze()
        gc.enable()


def leave(code: int) -> NoReturn:
    """Ends this process, without taking its modules and their objects apart.

    That takes up to a second where JAX and compiled loops are loaded. Threads end, what is
    registered for the end is called, and streams are flushed, as Python itself does.
    """
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    os._exit(code)


def _run_reported(work: Work, args: argparse.Namespace) -> int:
    try:
        work(args)
    except KeyboardInterrupt:
        LOG.error("interrupted: run the same command again to finish")
        return 130
    except Exception as error:  # noqa: BLE001  (told, and kept in the log)
        return _report(error, args)
    return 0


def _report(error: Exception, args: argparse.Namespace) -> int:
    """Reports an error in words; returns the exit code."""
    log: Path | None = args.log
    if isinstance(error, UserError):
        if error.file is None and error.key is not None:
            error.file = str(getattr(args, "problem", None) or "") or None
        LOG.error("error: %s", error)
        return 2
    if isinstance(error, OSError):
        LOG.error("error: %s", refusal(error.filename or ".", error))
    elif remedy := getattr(error, "remedy", None):  # no compiler, for one
        LOG.error("error: %s", UserError(str(error), remedy=remedy))
    elif isinstance(error, MemoryError):
        remedy = "ask for fewer samples, cases or units, or take a machine with more of it"
        LOG.error("error: %s", UserError("the memory is full", remedy=remedy))
    elif log is None:
        LOG.error("error: a bug: %s: %s", type(error).__name__, error, exc_info=error)
    else:
        where = f"its traceback is in {log}"
        LOG.error("error: a bug: %s: %s; %s", type(error).__name__, error, where)
    if log is not None:
        LOG.debug("traceback", exc_info=error)
    return 1


@contextmanager
def _logging(log: Path | None, *, quiet: bool) -> Iterator[None]:
    """Sends messages of the project to stderr, and all that there is to the log."""
    console = logging.StreamHandler()
    console.setFormatter(_MessageFormatter())
    console.setLevel(logging.ERROR if quiet else logging.INFO)
    console.addFilter(lambda record: not getattr(record, "drawn", False))
    handlers: list[logging.Handler] = [console]
    if log is not None:
        handlers.append(_log_file(log))
    loggers = [logging.getLogger(package) for package in _LOGGERS]
    for logger in loggers:
        logger.setLevel(logging.INFO if log is None else logging.DEBUG)
        for handler in handlers:
            logger.addHandler(handler)
    try:
        yield
    finally:
        for handler in handlers:
            for logger in loggers:
                logger.removeHandler(handler)
            handler.close()


class _MessageFormatter(logging.Formatter):
    """Writes messages as they are; warnings are called so."""

    def format(self, record: logging.LogRecord) -> str:
        """See ``logging.Formatter``."""
        text = super().format(record)
        return f"warning: {text}" if record.levelno == logging.WARNING else text


def _log_file(log: Path) -> logging.Handler:
    try:
        log.parent.mkdir(parents=True, exist_ok=True)
        handler = logging.FileHandler(log, encoding="utf-8")
    except OSError as error:
        raise refusal(log, error) from error
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s"))
    handler.setLevel(logging.DEBUG)
    return handler


@contextmanager
def _handle_termination() -> Iterator[None]:
    """Lets SIGTERM unwind the stack, so that what is half done is put away.

    An exception amid a library's lock may leave it held, and the unwinding wait for it: the process
    ends all the same after a while.
    """

    def leave(number: int, frame: FrameType | None) -> None:
        del frame
        signal.alarm(GRACE)
        raise SystemExit(128 + number)

    before = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGTERM, before)
