"""Many damaged files, tried in processes of their own: what came of each."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from typing import Any

from pipeline.runtime import ROOT
from tests.hostile.subjects import SUBJECTS

ENDS = ("refused", "same", "changed", "wrong")

Outcome = dict[str, Any]


def outcomes(count: int, seed: int) -> list[Outcome]:
    """What came of so many trials; one that ends its process went wrong."""
    found: list[Outcome] = []
    waiting = list(range(count))
    while waiting:
        done, begun, code = _batch(waiting, seed)
        found += done
        waiting = waiting[len(done) :]
        if begun is not None:
            found.append(_lost(begun, code))
            waiting = waiting[1:]
    return found


def _batch(numbers: Sequence[int], seed: int) -> tuple[list[Outcome], int | None, int]:
    """Outcomes until the process ended, the trial that it was at, if any, and its exit code."""
    words = [str(seed), ",".join(map(str, numbers))]
    command = [sys.executable, "-m", "tests.hostile.batch", *words]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    lines = [json.loads(line) for line in ended.stdout.splitlines() if line.startswith("{")]
    done = [line for line in lines if "end" in line]
    if len(done) == len(numbers):
        return done, None, 0
    if ended.returncode == 0 or not lines or "begun" not in lines[-1]:
        raise RuntimeError(f"the trials did not begin: {ended.stderr}")
    return done, lines[-1]["begun"], ended.returncode


def _lost(number: int, code: int) -> Outcome:
    subject = SUBJECTS[number % len(SUBJECTS)]
    about = {"number": number, "subject": subject.name, "sort": subject.sort, "damage": "?"}
    return {**about, "end": "wrong", "note": f"the process ended with {code}"}


def counts(found: Sequence[Outcome], key: str) -> list[dict[str, Any]]:
    """How many of each `key` ended how, in the order of their first trial."""
    rows = []
    for name in dict.fromkeys(each[key] for each in found):
        ends = Counter(each["end"] for each in found if each[key] == name)
        rows.append({"what": name, "tried": ends.total(), **{end: ends[end] for end in ENDS}})
    return rows
