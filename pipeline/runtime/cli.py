"""The frame of every stage's command line: options, logs, and errors that people can read.

A stage's `main` is `return cli.run(work, parser(), argv)`; what `work` needs beyond the standard
library it imports itself, so that --help is instant.
"""

from __future__ import annotations

import argparse
import logging
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from pipeline.runtime import streams
from pipeline.runtime.errors import UserError, refusal
from pipeline.runtime.progress import Progress as progress  # noqa: N813  (reads as a verb at its callers)

__all__ = ["parser", "progress", "run"]

Work = Callable[[argparse.Namespace], None]

LOG = logging.getLogger(__name__)
_ROOMS = ("sim", "pipeline", "reports", "__main__")  # a stage that is run has the last name


def parser(stage: str, description: str, *, study: bool = True) -> argparse.ArgumentParser:
    """A command line for `python -m <stage>` with the options that all stages share.

    Args:
        stage: the module's name.
        description: what it reads, does and writes.
        study: whether it wants --problem and --preset.
    """
    made = argparse.ArgumentParser(
        prog=f"python -m {stage}",
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    if study:
        made.add_argument(
            "--problem", type=Path, required=True, metavar="YAML", help="the problem file"
        )
        made.add_argument("--preset", metavar="NAME", help="one of the presets in the problem file")
    made.add_argument("--log", type=Path, metavar="FILE", help="also write messages to this file")
    made.add_argument("--quiet", action="store_true", help="print nothing but errors")
    return made


def run(work: Work, made: argparse.ArgumentParser, argv: Sequence[str] | None = None) -> int:
    """Parse the command line, do the work, and tell of errors in words.

    Returns:
        The exit code: 0 done, 2 a mistake in the input, 1 the machine refused or there is a bug,
        130 Ctrl-C; a SIGTERM exits with 143.
    """
    streams.complete()
    args = made.parse_args(argv)
    try:
        with _logging(args.log, quiet=args.quiet), _terminable():
            return _guarded(work, args)
    except UserError as error:  # the log itself could not be written
        print(f"error: {error}", file=sys.stderr)  # noqa: T201
        return 2


def _guarded(work: Work, args: argparse.Namespace) -> int:
    try:
        work(args)
    except UserError as error:
        LOG.error("error: %s", error)
        return 2
    except KeyboardInterrupt:
        LOG.error("interrupted: run the same command again to finish")
        return 130
    except OSError as error:
        LOG.error("error: %s", refusal(error.filename or ".", error))
        _keep_traceback(args.log)
        return 1
    except MemoryError:
        remedy = "ask for fewer samples, cases or units, or take a machine with more of it"
        LOG.error("error: %s", UserError("the memory is full", remedy=remedy))
        _keep_traceback(args.log)
        return 1
    except Exception as error:
        if args.log is None:
            LOG.exception("error: a bug: %s: %s", type(error).__name__, error)
        else:
            where = f"its traceback is in {args.log}"
            LOG.error("error: a bug: %s: %s; %s", type(error).__name__, error, where)
            _keep_traceback(args.log)
        return 1
    return 0


def _keep_traceback(log: Path | None) -> None:
    if log is not None:
        LOG.debug("traceback", exc_info=True)


@contextmanager
def _logging(log: Path | None, *, quiet: bool) -> Iterator[None]:
    """Messages of the project to stderr, and all that there is to the log."""
    console = logging.StreamHandler()
    console.setLevel(logging.ERROR if quiet else logging.INFO)
    console.addFilter(lambda record: not getattr(record, "drawn", False))
    handlers: list[logging.Handler] = [console]
    if log is not None:
        handlers.append(_log_file(log))
    loggers = [logging.getLogger(room) for room in _ROOMS]
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
def _terminable() -> Iterator[None]:
    """SIGTERM unwinds the stack, so that what is half done is put away."""

    def leave(number: int, frame: FrameType | None) -> None:
        del frame
        raise SystemExit(128 + number)

    before = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
