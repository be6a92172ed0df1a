"""Kills a small study from end to end at random moments, and compares what is there at the end."""

import os
import shutil
import signal
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from random import Random

import yaml

from pipeline.problem.reading import overlay_keys
from tests.e2e.checkout import Checkout

RECORDING = """
title: A small specimen
structure: cloaked
specimen: bare
pixel_size: 0.4 mm
virtual:
  rate: 30 Hz
  camera: { image: [256, 256], pixel_size: 0.4 mm }
  codec: { name: h264, crf: 14 }
"""
SMALLEST = yaml.safe_load("""
optimiser: { methods: { sqp: { evaluations: 4 }, mma: null } }
prediction: { samples: 2 }
sweep: { grid: { drive.directions: { points: 2 }, drive.frequency: { points: 2 } } }
""")
NOT_RESULTS = ("logs", ".journal")


@dataclass(frozen=True)
class Kill:
    """One end of a run: seconds after its start, files being written, the newest log's stage."""

    after: float
    writing: tuple[str, ...]
    at_work: str


def filmed(checkout: Checkout) -> Checkout:
    """Gives the checkout a study as small as can be, and a recording of it."""
    asked = yaml.safe_load(checkout.problem.read_text(encoding="utf-8"))
    asked = overlay_keys(asked, SMALLEST)
    checkout.problem.write_text(yaml.safe_dump(asked, sort_keys=False), encoding="utf-8")
    folder = checkout.problem.parent / "recordings"
    folder.mkdir(exist_ok=True)
    (folder / "cloaked.yaml").write_text(RECORDING, encoding="utf-8")
    return checkout


def built(checkout: Checkout) -> dict[str, bytes]:
    """Reads all results, by name."""
    folder = checkout.results
    found = {path.relative_to(folder): path for path in sorted(folder.rglob("*")) if path.is_file()}
    wanted = (name for name in found if name.parts[0] not in NOT_RESULTS)
    return {str(name): found[name].read_bytes() for name in wanted}


def finished(checkout: Checkout) -> None:
    """Builds the study to its end."""
    ended = checkout.make()
    assert ended.returncode == 0, ended.stdout + ended.stderr


def killed(
    checkout: Checkout,
    wanted: dict[str, bytes],
    count: int,
    seed: int,
    span: float,
    tell: Callable[[Kill], None],
) -> list[str]:
    """Kills so many runs at random, each going on where the last was; returns the differences.

    Half of the kills wait for a file that is being written. A run that ends before its kill must
    have built what is wanted; the next one begins anew.

    Args:
        checkout: where they run.
        wanted: the results of an undisturbed run.
        count: of kills.
        seed: of the moments.
        span: the longest time that a kill waits, s.
        tell: is given each kill.
    """
    random, wrong, left = Random(seed), [], count
    while left:
        kill = _one(checkout, random, span)
        if kill is None:
            wrong += differences(checkout, wanted)
            shutil.rmtree(checkout.results)
        else:
            left -= 1
            tell(kill)
    finished(checkout)
    return wrong + differences(checkout, wanted)


def _one(checkout: Checkout, random: Random, span: float) -> Kill | None:
    """Kills a run, with all that it started; None if it ended by itself."""
    writing, moment = random.random() < 0.5, random.uniform(0.5, span)
    start = time.monotonic()
    run = checkout.start()
    while run.poll() is None:
        after = time.monotonic() - start
        parts = _parts(checkout)
        if (after > moment and not writing) or (parts and after > moment / 4 and writing):
            os.killpg(run.pid, signal.SIGKILL)
            run.communicate()
            return Kill(round(after, 3), parts, _at_work(checkout))
        time.sleep(0.001)
    told = run.communicate()[0]
    assert run.returncode == 0, told
    return None


def _parts(checkout: Checkout) -> tuple[str, ...]:
    """Names what is being written; folders may go while they are looked into."""
    walked = os.walk(checkout.results)
    names = (name for _, folders, files in walked for name in (*folders, *files))
    return tuple(sorted(name for name in names if name.startswith(".") and "part" in name))


def _at_work(checkout: Checkout) -> str:
    logs = list((checkout.results / "logs").glob("*.log"))
    return max(logs, key=lambda path: path.stat().st_mtime).stem if logs else "nothing yet"


def differences(checkout: Checkout, wanted: Mapping[str, bytes]) -> list[str]:
    """Names the results that differ from the wanted ones, or that only one has."""
    found = built(checkout)
    names = sorted(found.keys() | wanted.keys())
    return [name for name in names if found.get(name) != wanted.get(name)]
