"""Damages files and reads them as the stages do, many in a process of their own, which may crash.

``python -m tests.hostile.inputs SEED NUMBERS [SORT]`` tries some, of all files or of one sort: a
line of JSON before and after each.
"""

import json
import logging
import math
import resource
import signal
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

from pipeline.runtime import ROOT, UserError
from tests.hostile import damage
from tests.hostile.subjects import SUBJECTS, Subject, Told

ROOM = 3 << 30
"""Bytes of memory that a trial may take beyond what the process has when it starts."""
PATIENCE = 60.0
"""Seconds of CPU that a trial may take."""
ENDS = ("refused", "same", "changed", "wrong")
"""Refused in words that name the file; read as before; read as another sound file of a user's
own, which nothing could tell from the one that was meant; or anything else."""

Outcome = dict[str, Any]
"""Of a trial: number, subject, sort of the file, damage, end, and a message as note."""


def outcomes(count: int, seed: int, sort: str = "") -> list[Outcome]:
    """Runs so many trials, of files of a sort or of all; one that ends its process went wrong."""
    found: list[Outcome] = []
    waiting = list(range(count))
    while waiting:
        done, begun, code = _batch(waiting, seed, sort)
        found += done
        waiting = waiting[len(done) :]
        if begun is not None:
            subject = _subject(begun, sort)
            found.append(_outcome(begun, subject, "?", "wrong", f"the process ended with {code}"))
            waiting = waiting[1:]
    return found


def _subject(number: int, sort: str) -> Subject:
    """Chooses what a trial damages."""
    known = [each for each in SUBJECTS if sort in ("", each.sort)]
    return known[number % len(known)]


def _batch(numbers: Sequence[int], seed: int, sort: str) -> tuple[list[Outcome], int | None, int]:
    """Runs trials until the process ends: outcomes, the trial it was at, if any, its exit code."""
    words = [str(seed), ",".join(map(str, numbers)), sort]
    command = [sys.executable, "-m", "tests.hostile.inputs", *words]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    lines = [json.loads(line) for line in ended.stdout.splitlines() if line.startswith("{")]
    done = [line for line in lines if "end" in line]
    if len(done) == len(numbers):
        return done, None, 0
    if ended.returncode == 0 or not lines or "begun" not in lines[-1]:
        raise RuntimeError(f"the trials did not begin: {ended.stderr}")
    return done, lines[-1]["begun"], ended.returncode


def counts(found: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Counts how many of each subject ended how, in the order of their first trial."""
    rows = []
    for name in dict.fromkeys(each["subject"] for each in found):
        ends = Counter(each["end"] for each in found if each["subject"] == name)
        rows.append({"what": name, "tried": ends.total(), **{end: ends[end] for end in ENDS}})
    return rows


def tried(number: int, seed: int, sort: str) -> Outcome:
    """Runs a trial, which its number and the seed determine."""
    random = Random(f"{seed}/{number}")
    subject = _subject(number, sort)
    good = _good(subject)
    with tempfile.TemporaryDirectory() as name:
        path = subject.make(Path(name))
        how, bad = _damaged(subject, path.read_bytes(), random)
        path.write_bytes(bad)
        sealed = subject.sealed and not how.startswith(damage.OWN)
        return _outcome(number, subject, how, *_end(subject, path, good, sealed=sealed))


def _outcome(number: int, subject: Subject, how: str, end: str, note: str) -> Outcome:
    about = {"number": number, "subject": subject.name, "sort": subject.sort}
    return {**about, "damage": how, "end": end, "note": note}


def _damaged(subject: Subject, good: bytes, random: Random) -> tuple[str, bytes]:
    known = (*damage.ANY, *subject.damages, *subject.damages)
    if random.random() < 1 / len(known):
        other = random.choice([each for each in SUBJECTS if each is not subject])
        with tempfile.TemporaryDirectory() as name:
            return "swapped", other.make(Path(name)).read_bytes()
    how, damaged = random.choice(known)
    return how, damaged(good, random)


def _end(subject: Subject, path: Path, good: Told, *, sealed: bool) -> tuple[str, str]:
    try:
        told = subject.read(path)
    except UserError as error:
        named = any(name in str(error) for name in (path.name, "problem.yaml"))
        by_key = error.file is None and error.key is not None  # the command line adds the problem
        return ("refused" if named or by_key else "wrong"), str(error)
    except BaseException as error:  # noqa: BLE001  (whatever it is, it is what is looked for)
        return "wrong", f"{type(error).__name__}: {error}"
    if json.dumps(told, default=str) == json.dumps(good, default=str):
        return "same", ""
    if sealed and (subject.whole or not all(each in good for each in told)):
        return "wrong", "read in silence, as something else"
    # no number is infinite; datasets have gaps, whose places their tables tell
    infinite = any(math.isinf(each) for each in _leaves(told) if isinstance(each, float))
    return ("wrong", "not finite") if infinite else ("changed", "")


@cache
def _good(subject: Subject) -> Told:
    with tempfile.TemporaryDirectory() as name:
        return subject.read(subject.make(Path(name)))


def _leaves(told: object) -> Iterator[object]:
    if isinstance(told, dict | list | tuple):
        for each in told.values() if isinstance(told, dict) else told:
            yield from _leaves(each)
    else:
        yield told


def main(numbers: list[int], seed: int, sort: str) -> None:
    """Runs trials under limits of memory and time."""
    logging.disable()
    warnings.simplefilter("ignore")
    used = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    limit = used * resource.getpagesize() + ROOM
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    for number in numbers:
        _tell({"begun": number})
        signal.setitimer(signal.ITIMER_PROF, PATIENCE)
        _tell(tried(number, seed, sort))


def _tell(what: dict[str, object]) -> None:
    sys.stdout.write(f"{json.dumps(what)}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main([int(word) for word in sys.argv[2].split(",")], int(sys.argv[1]), sys.argv[3])
