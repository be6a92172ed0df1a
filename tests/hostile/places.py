"""Works where nobody should: full disks, odd paths, wrong clocks, no terminal, no fonts."""

import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tests.e2e.checkout import STUDY, Checkout
from tests.e2e.test_mistakes import LITTLE_ROOM, ORDINARY_RIGHTS
from tests.hostile.kills import built, differences, finished

YEAR = 365 * 86400
ROOM_KIB = 24
TARGET = Path("results") / STUDY
SILENT = (
    "exec 0<&- 1>&- 2>&-; unset TERM; exec make --old-file=.venv/requirements.lock --old-file=setup"
)


@dataclass(frozen=True)
class Tried:
    """One attempt: what was wrong with the place, what was tried, and what went wrong, if any."""

    place: str
    what: str
    fault: str = ""


Attempt = Callable[[Checkout], Iterator[Tried]]


def stages(out: Path) -> dict[str, list[str]]:
    """Returns the command lines of the stages that write, from what is built to a folder."""
    study = ["--problem", f"experiments/{STUDY}/problem.yaml"]
    design, response = (f"{TARGET}/{name}.nc" for name in ("design", "response"))
    film, track = f"{TARGET}/recordings/cloaked", f"{TARGET}/recordings/cloaked/track.nc"
    shown = ["--design", design, "--response", response]
    return {
        "select": [*study, "--designs", f"{TARGET}/design_sqp.nc", "--out", f"{out}/design.nc"],
        "simulate": [*study, "--design", design, "--out", f"{out}/response.nc"],
        "film": [
            *("render", f"experiments/{STUDY}/recordings/cloaked.yaml", *shown),
            *("--out", f"{out}/film.mp4"),
        ],
        "track": [f"{film}.yaml", "--design", design, "--out", f"{out}/track.nc", "--no-report"],
        "compare": [
            *(*study, *shown, "--recording", f"{film}.yaml", "--track", track),
            *("--out", f"{out}/comparison.nc"),
        ],
        "report": [
            *(*study, *shown, "--sweep", f"{TARGET}/sweep.nc", "--comparisons"),
            *(f"{TARGET}/recordings/cloaked/comparison.nc", "--out-dir", f"{out}/report"),
        ],
    }


def _run(checkout: Checkout, name: str, words: list[str], first: str = "") -> str:
    """Runs a stage that must fail in words; returns its fault, or an empty text."""
    module = "reports study" if name == "report" else f"pipeline {name}"
    ended = checkout.module(module, *words, first=first)
    told = ended.stdout + ended.stderr
    if ended.returncode == 0:
        return "it says that it has succeeded"
    if "Traceback" in told or told.count("error: ") != 1 or "remedy:" not in told:
        return told
    return ""


def _files(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def refused(checkout: Checkout, place: str, folder: Path, first: str) -> Iterator[Tried]:
    """Runs every stage where it cannot write what it should; what was there stays."""
    for name, words in stages(folder).items():
        before = _files(folder)
        fault = _run(checkout, name, words, first)
        if not fault and (now := _files(folder)) != before:
            fault = f"left behind: {sorted(map(str, now))}"
        yield Tried(place, name, fault)


def small_files(checkout: Checkout) -> Iterator[Tried]:
    """Lets files not grow: libraries meet it in the middle of a write, as on a full disk."""
    with tempfile.TemporaryDirectory() as folder:
        room = LITTLE_ROOM.replace("16 << 10, 16 << 10", "2 << 10, 2 << 10")
        yield from refused(checkout, "limit of file sizes", Path(folder), room)


@contextmanager
def _small_disk() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as folder:
        size = f"size={ROOM_KIB}k"
        subprocess.run(["mount", "-t", "tmpfs", "-o", size, "tmpfs", folder], check=True)
        try:
            yield Path(folder)
        finally:
            subprocess.run(["umount", folder], check=True)


def full_disk(checkout: Checkout) -> Iterator[Tried]:
    """Fills a file system of some KiB."""
    with _small_disk() as folder:
        (folder / "ballast").write_bytes(bytes((ROOM_KIB - 8) << 10))
        yield from refused(checkout, "full disk", folder, "")


def read_only(checkout: Checkout) -> Iterator[Tried]:
    """Closes a folder to writers."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name, "closed")
        folder.mkdir(mode=0o555)
        yield from refused(checkout, "read-only folder", folder, ORDINARY_RIGHTS)


def two_at_once(checkout: Checkout) -> Iterator[Tried]:
    """Runs two processes that write the same file."""
    with tempfile.TemporaryDirectory() as folder:
        words = stages(Path(folder))["simulate"]
        command = [".venv/bin/python", "-m", "pipeline", "simulate", *words]
        start = partial(subprocess.Popen, command, cwd=checkout.root, stderr=subprocess.DEVNULL)
        codes = [run.wait() for run in (start(), start())]
        paths = Path(folder, "response.nc"), checkout.results / "response.nc"
        same = len({path.read_bytes() for path in paths}) == 1
        fault = "" if same and 0 in codes else f"exit codes {codes}, same bytes: {same}"
        yield Tried("two runs at once", "simulate", fault)


def wrong_clock(checkout: Checkout) -> Iterator[Tried]:
    """Sets the clock: files are of the future, or of a distant past."""
    wanted = built(checkout)
    for place, date in (("clock set back", time.time() + YEAR), ("clock set on", YEAR)):
        for path in (*checkout.results.rglob("*"), *(checkout.root / "experiments").rglob("*")):
            os.utime(path, (date, date))
        yield Tried(place, "make", _made(checkout, wanted))
        again = checkout.snakemake()
        told = again.stdout + again.stderr
        yield Tried(place, "make again", "" if "Nothing to be done" in told else told)


def _made(checkout: Checkout, wanted: Mapping[str, bytes]) -> str:
    """Builds the study; returns what goes wrong, if anything."""
    try:
        finished(checkout)
    except AssertionError as error:
        return str(error)
    return _other_bytes(checkout, wanted)


def _other_bytes(checkout: Checkout, wanted: Mapping[str, bytes]) -> str:
    """Names the results that differ or are missing, if any."""
    names = differences(checkout, wanted)
    return f"other bytes: {', '.join(names)}" if names else ""


def no_terminal(checkout: Checkout) -> Iterator[Tried]:
    """Closes the standard streams, without TERM."""
    wanted = built(checkout)
    for name in ("recordings", "report"):  # of a result that is there, nothing is made anew
        shutil.rmtree(checkout.results / name)
    command = ["bash", "-c", f"{SILENT} {STUDY}"]
    subprocess.run(command, cwd=checkout.root, check=False)
    yield Tried("no terminal", "make", _other_bytes(checkout, wanted))


def no_fonts(checkout: Checkout) -> Iterator[Tried]:
    """Hides home, fonts of the system and their cache."""
    with tempfile.TemporaryDirectory() as folder:
        nowhere = {"HOME": "/nonexistent", "FONTCONFIG_FILE": "/nonexistent"}
        nowhere |= {"XDG_CACHE_HOME": f"{folder}/cache", "MPLCONFIGDIR": f"{folder}/matplotlib"}
        words = stages(Path(folder))["report"]
        command = [".venv/bin/python", "-m", "reports", "study", *words]
        environment = {**os.environ, **nowhere}
        ended = subprocess.run(
            command, cwd=checkout.root, env=environment, capture_output=True, text=True, check=False
        )
        made = {path.name: path.read_bytes() for path in Path(folder, "report").iterdir()}
        report = checkout.results / "report"
        same = made == {path.name: path.read_bytes() for path in report.iterdir()}
        yield Tried("missing fonts", "report", "" if same else ended.stderr or "other bytes")


def odd_paths(checkout: Checkout) -> Iterator[Tried]:
    """Builds in paths of spaces, quotes, other scripts, words of a shell, and great length."""
    wanted = built(checkout)
    with tempfile.TemporaryDirectory() as folder:
        names = {
            "non-ASCII and spaces": "größe 漢字 with spaces",
            "quotes and a shell's words": """it's "$(touch pwned)"; `touch pwned` & $HOME""",
            "very long": "/".join(["a" * 200] * 12),
        }
        for place, name in names.items():
            other = checkout.copied(Path(folder) / name)
            fault = _made(other, wanted)
            pwned = list(Path(folder).rglob("pwned"))
            yield Tried(f"path: {place}", "make", fault or ("a command was run" if pwned else ""))


ALL: tuple[Attempt, ...] = (
    *(small_files, full_disk, read_only, two_at_once, no_fonts, no_terminal, wrong_clock),
    odd_paths,
)
