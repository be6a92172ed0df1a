"""Trials in a process of their own, which may crash: one line of JSON before and after each."""

from __future__ import annotations

import json
import logging
import resource
import signal
import sys
import warnings
from dataclasses import asdict
from pathlib import Path

from tests.hostile import trial

ROOM = 3 << 30
"""Bytes of memory that a trial may take beyond what the process has when it starts."""
PATIENCE = 60.0
"""Seconds of CPU that a trial may take."""


def main(numbers: list[int], seed: int) -> None:
    """Runs the trials, under limits of memory and time."""
    logging.disable()
    warnings.simplefilter("ignore")
    used = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    limit = used * resource.getpagesize() + ROOM
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    for number in numbers:
        _tell({"begun": number})
        signal.setitimer(signal.ITIMER_PROF, PATIENCE)
        _tell(asdict(trial.tried(number, seed)))


def _tell(what: dict[str, object]) -> None:
    sys.stdout.write(f"{json.dumps(what)}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main([int(word) for word in sys.argv[2].split(",")], int(sys.argv[1]))
