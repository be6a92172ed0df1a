"""Stores equilibrium paths: each evaluation starts from the last accepted design's.

Which path a solve starts from shows in the last bits of its result, so a resumed run must start
from the same ones. Each path is on the disc before its evaluation enters the journal, and stays
there as long as it may be needed: the last accepted one and the newest.
"""

import hashlib
import logging
import os
import zlib
from collections.abc import Sequence
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from sim.core import Floats
from sim.optimise import Evaluation
from sim.quasistatics import StaticRecord

log = logging.getLogger(__name__)

_FIELDS_KEPT = ("states", "tangents", "stable", "jumped", "snapped", "eigenvalue")
"""Parts of a record that are stored."""


class Paths:
    """Stores the paths of an optimisation's designs in a folder, a record for each case."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._accepted: str | None = None

    def start(self) -> list[StaticRecord] | None:
        """Reads the records of the last accepted design, to start the next evaluation from."""
        if self._accepted is None:
            return None
        path = self.folder / self._accepted
        if not path.exists():
            log.warning("%s is gone: the next evaluation starts from scratch", path)
            return None
        try:
            return _records(path)
        except (OSError, ValueError, LookupError, EOFError, BadZipFile, zlib.error) as error:
            log.warning("%s is damaged (%s): the next evaluation starts from scratch", path, error)
            return None

    def keep(self, design: Floats, records: Sequence[StaticRecord]) -> None:
        """Stores the records of an evaluation that was computed just now."""
        name = _name(design)
        self.folder.mkdir(parents=True, exist_ok=True)
        for old in self.folder.iterdir():
            if old.name not in (name, self._accepted):
                old.unlink()
        unfinished = self.folder / f"{name}.new"
        with unfinished.open("wb") as file:
            parts = {
                name: np.stack([getattr(one, name) for one in records]) for name in _FIELDS_KEPT
            }
            np.savez(file, allow_pickle=False, **parts)
            file.flush()
            os.fsync(file.fileno())
        unfinished.rename(self.folder / name)

    def accept(self, evaluation: Evaluation) -> None:
        """Stores the records of an accepted evaluation, computed or read back from the journal."""
        if evaluation.accepted and evaluation.failure is None:
            self._accepted = _name(evaluation.x)


def _records(path: Path) -> list[StaticRecord]:
    """Reads the records in a file, whose entries have checksums."""
    with np.load(path) as stored:
        parts = {name: stored[name] for name in _FIELDS_KEPT}
    return [
        StaticRecord(
            **{name: part[case] for name, part in parts.items()}, counts=np.zeros(4, dtype=np.int64)
        )
        for case in range(len(parts["states"]))
    ]


def _name(design: Floats) -> str:
    return hashlib.sha256(design.tobytes()).hexdigest()[:32]
