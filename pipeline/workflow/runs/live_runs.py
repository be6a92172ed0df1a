"""Names the runs of snakemake by process and host, and tells which of them live."""

from __future__ import annotations

import os
import socket
import sys
from pathlib import Path
from typing import NamedTuple

import psutil

SNAKEMAKE = (sys.executable, "-m", "snakemake")
"""Begins the command of a run; a script of an environment that was moved does not start."""


class Run(NamedTuple):
    """Names one run: the number of its process, and the host that this is at work on."""

    process: int
    host: str

    @classmethod
    def own(cls) -> Run:
        """Names the run that this process is."""
        return cls(os.getpid(), socket.gethostname())

    @classmethod
    def parse(cls, text: str) -> Run | None:
        """Reads "4711 on login1"; a number alone is of this host, and other words are no run."""
        number, _, host = text.partition(" on ")
        return cls(int(number), host or socket.gethostname()) if number.isdecimal() else None

    def __str__(self) -> str:
        return f"{self.process} on {self.host}"

    @property
    def here(self) -> bool:
        """Tells whether it is, or was, a run on this host."""
        return self.host == socket.gethostname()

    @property
    def may_live(self) -> bool:
        """Tells whether it is at work, as far as this host sees: a run on another one may be."""
        return not self.here or _is_snakemake(self.process)

    @property
    def remedy(self) -> str:
        """Tells how to come after it; a run that is killed takes its stages along."""
        return f"wait for it, or end it there with: kill -9 {self.process}"


def _is_snakemake(process: int) -> bool:
    """Tells a run, however it was started, from what got its number after its end."""
    try:
        words = psutil.Process(process).cmdline()
    except psutil.Error:
        return False
    return any(Path(word).name == "snakemake" for word in words)
