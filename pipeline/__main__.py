"""Runs a stage by its name: `python -m pipeline STAGE ...`, or `metacloak STAGE ...`."""

import difflib
import sys
from argparse import Namespace
from collections.abc import Sequence
from functools import partial

from pipeline.runtime import PREFIX, STAGES, Stage, UserError, cli, delegate, streams, version

_HELP = ("-h", "--help")


def main(argv: Sequence[str] | None = None) -> int:
    """Looks up the stage that the first word names, and runs it with the others."""
    with streams.unread():
        return _main(argv)
    return 0  # nobody read on


def _main(argv: Sequence[str] | None) -> int:
    words = sys.argv[1:] if argv is None else list(argv)
    if not words or words[0] in _HELP:
        print(overview())  # noqa: T201
        return 0
    if words[0] == "--version":
        print(f"metacloak {version()}")  # noqa: T201
        return 0
    if words[0] not in STAGES:
        alike = difflib.get_close_matches(words[0], STAGES, n=1)
        remedy = f"did you mean {alike[0]}?" if alike else "see --help"
        print(f"error: no stage is named {words[0]!r}: {remedy}", file=sys.stderr)  # noqa: T201
        return 2
    return run_stage(words[0], words[1:])


def _delegated() -> int | None:
    """Has a server of the workflow run the stage, where there is one; returns its exit code."""
    stage = STAGES.get("".join(sys.argv[1:2]))
    if stage is None or stage.passes_on:
        return None
    code = delegate(f"{PREFIX}pipeline", PREFIX + stage.module)
    if code is None:
        from pipeline.workflow.runs import run_watch  # a client of the server starts without

        run_watch.end_with_run()
    return code


def run_stage(name: str, words: Sequence[str]) -> int:
    """Runs one stage of the table; returns the exit code."""
    stage = STAGES[name]
    if not stage.passes_on or set(words) & set(_HELP):
        return cli.run(partial(_work, stage), cli.command_line(stage), words)
    try:
        _work(stage, list(words))
    except UserError as error:
        print(f"error: {error}", file=sys.stderr)  # noqa: T201
        return 2
    return 0


def _work(stage: Stage, given: Namespace | list[str]) -> None:
    """Imports the module of a stage, and does its work."""
    try:
        cli.imported(PREFIX + stage.module).work(given)
    except ModuleNotFoundError as error:
        if (missing := str(error.name).partition(".")[0]) in ("sim", "pipeline", "metacloak"):
            raise
        what = f"the stage {stage.name} needs {missing}, which is not installed"
        remedy = f'pip install "metacloak[{stage.extra}]"'
        raise UserError(what, remedy=remedy) from error


def overview() -> str:
    """Lists the stages, a line each."""
    rows = [f"  {stage.name:<18}{stage.does}" for stage in STAGES.values()]
    usage = ["usage: python -m pipeline STAGE ...", "", "Options of one: STAGE --help", ""]
    return "\n".join([*usage, *rows])


if __name__ == "__main__":
    code = _delegated()
    cli.leave(main() if code is None else code)
