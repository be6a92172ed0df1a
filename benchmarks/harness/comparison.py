"""Compares a suite with the last one that was stored: ratios to a yardstick, never seconds.

The yardstick is a fixed job of LAPACK and of the interpreter, timed on the same core just before,
so that another machine, or the same one with other company, is compared fairly.
"""

import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import cho_factor

from benchmarks.harness.records import Measurement, quantities
from pipeline.runtime import ROOT, write_atomically

STORED = ROOT / "tests/data/benchmarks.json"
REGRESSION = 1.15
"""Ratio from which a change is told."""
ROUNDING = 1e-10
"""Errors below are rounding: how they change tells nothing."""
_ROUNDS, _SIZE, _LOOPS = 5, 400, 100_000

Record = dict[str, Any]
Errors = Mapping[str, float | None]


def yardstick() -> float:
    """Times the fixed job, the least processor time of some runs, s."""
    square = np.random.default_rng(0).normal(size=(_SIZE, _SIZE))
    matrix = square @ square.T + _SIZE * np.eye(_SIZE)

    def fixed_job() -> float:
        start = time.process_time()
        for _ in range(5):
            cho_factor(matrix)
        sum(n % 7 for n in range(_LOOPS))
        return time.process_time() - start

    return min(fixed_job() for _ in range(_ROUNDS))


def record(measured: list[Measurement], about: Mapping[str, Any], yardstick_s: float) -> Record:
    """Collects what is kept of a suite: times in yardsticks, errors, machine and commit.

    An error that is no finite number is kept as None.
    """
    return {
        **{key: about[key] for key in ("processor", "commit", "date")},
        "candidates": {
            one.name: {
                "time": one.seconds / yardstick_s,
                "errors": {
                    name: one.error(name) if np.isfinite(one.error(name)) else None
                    for name in quantities([one])
                },
            }
            for one in measured
            if one.cpu_s
        },
    }


def read_records(path: Path = STORED) -> dict[str, Record]:
    """Reads the records kept, by suite."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def keep(name: str, made: Record, path: Path = STORED) -> None:
    """Stores the record of a suite beside those of the others."""
    records = dict(sorted({**read_records(path), name: made}.items()))
    with write_atomically(path) as aside:
        aside.write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")


def find_regressions(
    now: Record, before: Mapping[str, Any], skipped: Sequence[str] = ()
) -> list[str]:
    """Lists regressions of time or accuracy by more than 15 %, and missing figures, a line each."""
    lines = []
    for name, known in before["candidates"].items():
        found = now["candidates"].get(name)
        if name in skipped:
            continue
        if found is None:
            lines.append(f"{name}: no figures any more")
            continue
        if found["time"] > REGRESSION * known["time"]:
            lines.append(f"{name}: slower, {found['time'] / known['time']:.2f} times the time")
        lines += [
            f"{name}: {line}" for line in _accuracy_regressions(found["errors"], known["errors"])
        ]
    return lines


def _accuracy_regressions(found: Errors, known: Errors) -> list[str]:
    lines = []
    for kind, was in known.items():
        if was is None:
            continue
        error, least = found.get(kind), max(was, ROUNDING)
        if error is None:
            lines.append(f"{kind} has no figure any more")
        elif error > REGRESSION * least:
            lines.append(f"{kind} less accurate, {error / least:.2f} times the error")
    return lines


def comparison_text(
    name: str, now: Record, path: Path = STORED, skipped: Sequence[str] = ()
) -> str:
    """Formats the comparison with the stored record, but for candidates that were skipped."""
    before = read_records(path).get(name)
    if before is None:
        return "  nothing stored to compare with: --keep stores this"
    origin = f"{before['date'][:10]}, {before['processor']}, commit {before['commit'][:10]}"
    lines = find_regressions(now, before, skipped) or [
        "nothing got slower or less accurate by more than 15 %"
    ]
    return "\n".join(f"  {line} (against {origin})" for line in lines)
