"""Tries to lose or to spoil something: ``python -m tests.hostile [inputs fuzz kills places]``."""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from pipeline.datasets import git_commit
from pipeline.runtime import write_atomically
from tests.e2e.checkout import Checkout
from tests.hostile import inputs, kills, places

Part = dict[str, Any]
T = TypeVar("T")
FUZZED = ("DXF", "SVG", "image", "CSV", "netCDF", "video")
"""Sorts of files of which many more are damaged."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Tries what is asked for, and writes the counts and the page; 1 if something was lost."""
    asked = _parser().parse_args(arguments)
    parts = {"inputs": _inputs, "fuzz": _fuzz, "kills": _kills, "places": _places}
    lost = 0
    for name in asked.parts or parts:
        made = {**parts[name](asked), "seed": asked.seed, "commit": git_commit()}
        with write_atomically(asked.out / f"{name}.json") as aside:
            text = json.dumps(made, indent=1, ensure_ascii=False)
            aside.write_text(f"{text}\n", encoding="utf-8")
        lost += len(made["faults"])
        count = sum(row["tried"] for row in made["rows"])
        _tell(f"{name}: {count} tried, {len(made['faults'])} lost")
    return int(lost > 0)


def _fuzz(asked: argparse.Namespace) -> Part:
    sorts = asked.sorts or FUZZED
    return _told([one for sort in sorts for one in inputs.outcomes(asked.fuzz, asked.seed, sort)])


def _inputs(asked: argparse.Namespace) -> Part:
    return _told(inputs.outcomes(asked.inputs, asked.seed))


def _told(found: list[inputs.Outcome]) -> Part:
    wrong = [each for each in found if each["end"] == "wrong"]
    rows = [{**row, "survived": row["tried"] - row["wrong"]} for row in inputs.counts(found)]
    faults = [f"{one['number']}: {one['subject']}, {one['damage']}: {one['note']}" for one in wrong]
    return {"rows": rows, "faults": faults}


@contextmanager
def built() -> Iterator[tuple[Checkout, float]]:
    """Builds a small study in a checkout; yields it, and how long that took, in s."""
    with tempfile.TemporaryDirectory() as folder:
        checkout = kills.filmed(Checkout.made(Path(folder, "checkout")))
        kills.finished(checkout)  # compiles
        again = checkout.copied(Path(folder, "grüße, again"))
        start = time.monotonic()
        kills.finished(again)
        yield again, time.monotonic() - start


def _kills(asked: argparse.Namespace) -> Part:
    found: list[kills.Kill] = []

    def tell(kill: kills.Kill) -> None:
        found.append(kill)
        _tell(str(kill))

    with built() as (checkout, span):
        other = checkout.copied(checkout.root.with_name("killed"))
        wanted = kills.built(checkout)
        faults = kills.killed(other, wanted, asked.kills, asked.seed, span, tell)
    rows = [
        {
            "what": stage,
            "tried": len(ends),
            "while writing": sum(bool(kill.writing) for kill in ends),
            "survived": 0 if faults else len(ends),
        }
        for stage, ends in _grouped(found, "at_work")
    ]
    return {"rows": rows, "faults": faults, "kills": [vars(kill) for kill in found]}


def _places(asked: argparse.Namespace) -> Part:
    del asked
    found: list[places.Tried] = []
    with built() as (checkout, _):
        for one in (one for attempt in places.ALL for one in attempt(checkout)):
            found.append(one)
            _tell(str(one))
    rows = [
        {"what": place, "tried": len(ends), "survived": sum(not one.fault for one in ends)}
        for place, ends in _grouped(found, "place")
    ]
    faults = [f"{one.place}, {one.what}: {one.fault}" for one in found if one.fault]
    return {"rows": rows, "faults": faults}


def _grouped(found: list[T], key: str) -> Iterator[tuple[str, list[T]]]:
    """Groups attempts by an attribute, in the order of their first."""
    for name in dict.fromkeys(getattr(one, key) for one in found):
        yield name, [one for one in found if getattr(one, key) == name]


def _tell(line: str) -> None:
    sys.stderr.write(f"{line}\n")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile", description=__doc__)
    add, out = parser.add_argument, Path("results/survival")
    add("parts", nargs="*", metavar="part", help="inputs, fuzz, kills, places; all")
    add("--inputs", type=int, default=1000, help="damaged files (%(default)s)")
    add("--fuzz", type=int, default=1000, help="damaged files of each sort (%(default)s)")
    add("--sorts", nargs="*", choices=FUZZED, help="of them; all")
    add("--kills", type=int, default=50, help="killed runs (%(default)s)")
    add("--seed", type=int, default=0, help="of what is random (%(default)s)")
    add("--out", type=Path, default=out, help="folder (%(default)s)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
