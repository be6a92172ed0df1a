"""Runs a stage by its name: `python -m pipeline STAGE ...`, or `metacloak STAGE ...`."""

from __future__ import annotations

import difflib
import importlib
import sys
from argparse import Namespace
from collections.abc import Sequence
from importlib.metadata import version

from pipeline.runtime import STAGES, cli

_HELP = ("-h", "--help")


def main(argv: Sequence[str] | None = None) -> int:
    """Looks up the stage that the first word names, and runs it with the others."""
    words = sys.argv[1:] if argv is None else list(argv)
    if not words or words[0] in _HELP:
        print(overview())  # noqa: T201
        return 0
    if words[0] == "--version":
        print(f"metacloak {version('metacloak')}")  # noqa: T201
        return 0
    if words[0] not in STAGES:
        alike = difflib.get_close_matches(words[0], STAGES, n=1)
        remedy = f"did you mean {alike[0]}?" if alike else "see --help"
        print(f"error: no stage is named {words[0]!r}: {remedy}", file=sys.stderr)  # noqa: T201
        return 2
    return run_stage(words[0], words[1:])


def run_stage(name: str, words: Sequence[str]) -> int:
    """Runs one stage of the table, whose module is imported for it; returns the exit code."""
    stage = STAGES[name]
    if stage.passes_on and not set(words[:1]) & set(_HELP):
        return int(importlib.import_module(stage.module).work(list(words)))

    def work(args: Namespace) -> None:
        importlib.import_module(stage.module).work(args)

    return cli.run(work, cli.command_line(stage), words)


def overview() -> str:
    """Lists the stages, a line each."""
    rows = [f"  {stage.name:<18}{stage.does}" for stage in STAGES.values()]
    usage = ["usage: python -m pipeline STAGE ...", "", "Options of one: STAGE --help", ""]
    return "\n".join([*usage, *rows])


if __name__ == "__main__":
    sys.exit(main())
