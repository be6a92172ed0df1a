"""Journals expensive evaluations: a killed optimisation resumes exactly where it was.

The optimisers are deterministic, so a run is resumed by running it again: evaluations that the
journal holds are read back bit for bit, the first one that it does not hold is computed. Each
record is flushed to the disc before its result is used, so a kill loses only the evaluation under
way.
"""

from __future__ import annotations

import fcntl
import json
import logging
import math
import os
import struct
import zlib
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Protocol

import numpy as np

from sim.core import Floats, SimulationError
from sim.optimise.problem import Evaluate

log = logging.getLogger(__name__)

_HEADER = struct.Struct("<4sQI")
_MAGIC = b"EVAL"


class Stateful(Protocol):
    """Holds what its evaluations leave for those that follow, as numbers (n,)."""

    state: Floats


class JournalInUseError(RuntimeError):
    """Reports that another process is writing to the journal."""


class Journal:
    """Appends evaluations to a file, and reads them back; use it as a context manager.

    Each record is a header (magic, length, CRC-32 of the payload) and a payload: a line of JSON
    with the shapes, then design, loss, gradient, more numbers and state as little-endian doubles. A
    damaged or incomplete tail is cut off at the last good record. A design that differs from the
    recorded one in any bit means that the code or the machine has changed since: the rest of the
    journal is then of no use, it is cut off with a warning, and the run continues by computing.

    The folder of `path` must exist. `key` is to name all that the loss depends on, as results are
    read back by it and the design alone; a journal of another `key` than the problem's is started
    anew, with a warning, and what it held is kept in a file of that name and `.old`.

    Raises:
        JournalInUseError: on entering, if another process holds it.
    """

    def __init__(self, path: Path, key: str) -> None:
        self.path = path
        self.key = key
        self.replayed = 0
        self._file: BinaryIO | None = None

    def __enter__(self) -> Journal:
        # "a" creates the file without touching what is there, "r+" allows cutting it.
        self.path.open("ab").close()
        self._file = self.path.open("r+b")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise JournalInUseError(
                f"{self.path} is being written by another process; wait for it or stop it"
            ) from None
        first = self._read()
        if first != self.key.encode():
            self._back_up()
            self._truncate(0)
            self._write(self.key.encode())
        self.replayed = 0
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None

    def _back_up(self) -> None:
        """Copies evaluations of another key to a file beside; none is read from there."""
        kept = self.path.with_name(f"{self.path.name}.old")
        content = self.path.read_bytes()
        count = sum(1 for _ in iter(self._read, None))
        if count:
            kept.write_bytes(content)
            what = "evaluations of another problem or program"
            log.warning("%s: %d %s, kept as %s; starting anew", self.path, count, what, kept.name)

    def wrap(self, evaluate: Evaluate, holder: Stateful | None = None) -> Evaluate:
        """Wraps ``evaluate``: reads its results back while the journal holds them.

        With them comes back the state in which the evaluation, or its failure, left ``holder``.
        """

        def evaluate_or_replay(x: Floats) -> tuple[float, Floats, Floats]:
            start = self._opened.tell()
            payload = self._read()
            if payload is not None and _design(payload) == x.tobytes():
                self.replayed += 1
                if holder is not None:
                    holder.state = _state(payload)
                return _outcome(payload)
            if payload is not None:
                log.warning("%s: evaluation %d differs, continuing anew", self.path, self.replayed)
                self._truncate(start)
            return self._compute(evaluate, x, holder)

        return evaluate_or_replay

    @property
    def _opened(self) -> BinaryIO:
        if self._file is None:
            raise RuntimeError("the journal is not open: use it in a with statement")
        return self._file

    def _compute(
        self, evaluate: Evaluate, x: Floats, holder: Stateful | None
    ) -> tuple[float, Floats, Floats]:
        outcome, failure = (float("nan"), np.zeros(0), np.zeros(0)), None
        try:
            loss, gradient, aux = evaluate(x)
            outcome = float(loss), np.array(gradient, dtype="<f8"), np.array(aux, dtype="<f8")
        except SimulationError as error:
            failure = error
        state = np.zeros(0) if holder is None else holder.state
        self._write(_encode(x, *outcome, state, failure))
        if failure is not None:
            raise failure
        return outcome

    def _read(self) -> bytes | None:
        """Reads the next payload, None at the end; cuts off what cannot be read."""
        start = self._opened.tell()
        header = self._opened.read(_HEADER.size)
        if len(header) == _HEADER.size:
            magic, length, checksum = _HEADER.unpack(header)
            if magic == _MAGIC and length <= self._size - self._opened.tell():
                payload = self._opened.read(length)
                if zlib.crc32(payload) == checksum:
                    return payload
        self._truncate(start)
        return None

    @property
    def _size(self) -> int:
        return os.fstat(self._opened.fileno()).st_size

    def _truncate(self, position: int) -> None:
        if self._size > position:
            self._opened.truncate(position)
            os.fsync(self._opened.fileno())
        self._opened.seek(position)

    def _write(self, payload: bytes) -> None:
        self._opened.write(_HEADER.pack(_MAGIC, len(payload), zlib.crc32(payload)) + payload)
        self._opened.flush()
        os.fsync(self._opened.fileno())


def _encode(
    x: Floats,
    loss: float,
    gradient: Floats,
    aux: Floats,
    state: Floats,
    failure: SimulationError | None,
) -> bytes:
    shapes: dict[str, object] = {
        "design": len(x),
        "gradient": len(gradient),
        "aux": list(aux.shape),
        "state": len(state),
        "failure": None if failure is None else str(failure),
    }
    if failure is not None:
        shapes |= {"step": _as_int(failure.step), "unit": _as_int(failure.unit)}
    numbers = np.concatenate([x, [loss], gradient, aux.ravel(), state]).astype("<f8")
    return json.dumps(shapes).encode() + b"\n" + numbers.tobytes()


def _as_int(number: int | None) -> int | None:
    return None if number is None else int(number)  # JSON knows no integers of NumPy


def _decode(payload: bytes) -> tuple[dict, Floats]:
    line, numbers = payload.split(b"\n", 1)
    return json.loads(line), np.frombuffer(numbers, dtype="<f8")


def _design(payload: bytes) -> bytes:
    shapes, numbers = _decode(payload)
    return numbers[: shapes["design"]].tobytes()


def _state(payload: bytes) -> Floats:
    shapes, numbers = _decode(payload)
    return numbers[len(numbers) - shapes["state"] :].copy()


def _outcome(payload: bytes) -> tuple[float, Floats, Floats]:
    shapes, numbers = _decode(payload)
    if shapes["failure"] is not None:
        raise SimulationError(shapes["failure"], shapes.get("step"), shapes.get("unit"))
    counts = [shapes["design"], 1, shapes["gradient"], math.prod(shapes["aux"])]
    _, loss, gradient, aux, _ = np.split(numbers, np.cumsum(counts))
    return float(loss[0]), gradient.copy(), aux.reshape(shapes["aux"]).copy()
