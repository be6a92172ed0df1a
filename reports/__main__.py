"""Makes a report: `python -m reports KIND ...`."""

import sys
from collections.abc import Sequence

from pipeline.runtime import PREFIX, cli, delegate, streams
from reports.catalogue import OPTIONS, REPORTS, ReportCommand


def main(argv: Sequence[str] | None = None) -> int:
    """Makes the report that the first word names; returns the exit code.

    The same datasets give the same bytes.
    """
    with streams.unread():
        return _main(argv)
    return 0  # nobody read on


def _main(argv: Sequence[str] | None) -> int:
    kind, *words = [*(sys.argv[1:] if argv is None else argv), ""]
    if kind in REPORTS:
        return _run(kind, REPORTS[kind], words[:-1])
    asks = kind in ("", "-h", "--help")
    lines = [f"  {name:16} {command.description}" for name, command in REPORTS.items()]
    text = "\n".join(["usage: python -m reports KIND ...; KIND --help tells more", *lines])
    message = text if asks else f"error: no report is called {kind!r}\n{text}"
    print(message, file=sys.stdout if asks else sys.stderr)
    return 0 if asks else 2


def _run(kind: str, command: ReportCommand, words: Sequence[str]) -> int:
    parser = cli.parser(f"reports {kind}", command.description, study=command.study)
    for word in command.options.split():
        flag = word.rstrip("?")
        parser.add_argument(flag, required=word == flag, **OPTIONS[flag])
    return cli.run(lambda args: cli.imported(PREFIX + command.module).report(args), parser, words)


if __name__ == "__main__":
    asked = REPORTS.get("".join(sys.argv[1:2]))
    code = delegate(f"{PREFIX}reports", PREFIX + asked.module) if asked else None
    if code is None:
        from pipeline.workflow.runs import run_watch  # a client of the server starts without

        run_watch.end_with_run()
    cli.leave(main() if code is None else code)
