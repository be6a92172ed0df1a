"""One damaged file, read as the stages read it: what comes of it."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from typing import Literal

from pipeline.runtime import UserError
from tests.hostile import damage, edits
from tests.hostile.subjects import SUBJECTS, Subject, Told

End = Literal["refused", "same", "changed", "wrong"]
"""Refused in words that name the file; read as before; read as another sound file of a user's
own, which nothing could tell from the one that was meant; or anything else."""


@dataclass(frozen=True)
class Outcome:
    """What came of a trial.

    Attributes:
        number: of the trial.
        subject: what was damaged.
        sort: of the file.
        damage: what befell it.
        end: how it ended.
        note: the message, or what went wrong.
    """

    number: int
    subject: str
    sort: str
    damage: str
    end: End
    note: str = ""


def tried(number: int, seed: int) -> Outcome:
    """A trial, which its number and the seed determine."""
    random = Random(f"{seed}/{number}")
    subject = SUBJECTS[number % len(SUBJECTS)]
    good = _good(subject)
    with tempfile.TemporaryDirectory() as name:
        path = subject.make(Path(name))
        how, bad = _damaged(subject, path.read_bytes(), random)
        path.write_bytes(bad)
        sealed = subject.sealed and not how.startswith(edits.OWN)
        end, note = _end(subject, path, good, sealed=sealed)
    return Outcome(number, subject.name, subject.sort, how, end, note)


def _damaged(subject: Subject, good: bytes, random: Random) -> tuple[str, bytes]:
    known = (*damage.ANY, *subject.damages, *subject.damages)
    if random.random() < 1 / len(known):
        return "swapped", _another(subject, random)
    chosen = random.choice(known)
    return chosen.__name__.replace("_", " "), chosen(good, random)


def _another(subject: Subject, random: Random) -> bytes:
    """What a file of another kind holds."""
    other = random.choice([each for each in SUBJECTS if each is not subject])
    with tempfile.TemporaryDirectory() as name:
        return other.make(Path(name)).read_bytes()


def _end(subject: Subject, path: Path, good: Told, *, sealed: bool) -> tuple[End, str]:
    try:
        told = subject.read(path)
    except UserError as error:
        named = path.name in str(error)
        return ("refused" if named else "wrong"), str(error)
    except BaseException as error:  # noqa: BLE001  (whatever it is, it is what is looked for)
        return "wrong", f"{type(error).__name__}: {error}"
    if _printed(told) == _printed(good):
        return "same", ""
    if sealed and (subject.whole or not all(each in good for each in told)):
        return "wrong", "read in silence, as something else"
    return ("changed", "") if _sound(told) else ("wrong", "not finite")


@cache
def _good(subject: Subject) -> Told:
    with tempfile.TemporaryDirectory() as name:
        return subject.read(subject.make(Path(name)))


def _printed(told: Told) -> str:
    return json.dumps(told, default=str)


def _sound(told: Told) -> bool:
    """Whether no number is infinite; datasets have gaps, whose places their tables tell."""
    return not any(math.isinf(each) for each in _leaves(told) if isinstance(each, float))


def _leaves(told: object) -> Iterator[object]:
    if isinstance(told, dict):
        told = list(told.values())
    if isinstance(told, list | tuple):
        for each in told:
            yield from _leaves(each)
    else:
        yield told
