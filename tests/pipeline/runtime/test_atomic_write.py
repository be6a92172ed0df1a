import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from pipeline.runtime import (
    CaseLog,
    SweepResult,
    begins_with,
    case_log,
    sidecar_path,
    write_atomically,
)
from tests.tables import refused

OTHER = """
import sys
from functools import partial
from pathlib import Path
from pipeline.runtime import write_atomically
with write_atomically(Path(sys.argv[1])) as aside:
    aside.write_text("theirs")
"""


def test_two_that_write_one_file_do_not_meet(tmp_path: Path) -> None:
    path = tmp_path / "out.txt"
    with write_atomically(path) as aside:
        aside.write_text("ours")
        subprocess.run([sys.executable, "-c", OTHER, str(path)], check=True)
        assert path.read_text() == "theirs"
        assert aside.read_text() == "ours"
    assert path.read_text() == "ours"
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_put_beside_a_result_replaces_nothing(tmp_path: Path) -> None:
    """Neither the result, nor what it is made of: the log of a load cell beside its video."""
    log = tmp_path / "run1.csv"
    named = partial(sidecar_path, ending=".csv", is_own=begins_with("of a track"))
    table = tmp_path / "track.csv"
    assert named(tmp_path / "track.nc", log) == table
    for out in ("run1.nc", "other.csv"):
        with refused("would be written over", "--out"):
            named(tmp_path / out, tmp_path / "run1.yaml", log)
    for text in ("of a tree", ""):
        table.write_text(text)
        with refused("which this did not make", "--out", file=table, remedy="track.csv is put"):
            named(tmp_path / "track.nc", log)
    table.write_text("# of a track\n")
    assert named(tmp_path / "track.nc", log) == table


def test_what_a_killed_process_left_goes_and_what_a_living_one_writes_stays(tmp_path: Path) -> None:
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    left, living = (tmp_path / f".part_{pid}_a[1].nc" for pid in (dead.pid, os.getppid()))
    left.touch()
    living.touch()
    with write_atomically(tmp_path / "a[1].nc") as aside:
        aside.touch()
    assert {path.name for path in tmp_path.iterdir()} == {"a[1].nc", living.name}


def test_a_folder_that_is_a_file_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with refused("", file=tmp_path / "file/out.txt"), write_atomically(tmp_path / "file/out.txt"):
        pass


FOUND = {
    number: SweepResult(number / 7, 1.0, -number / 9, "ok, more or less") for number in range(5)
}


def test_a_damaged_line_is_computed_again_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "part_0.csv"
    with CaseLog(path, ["drive.frequency", "lattice, in words"]) as book:
        book.add((number, [f"{number} Hz", "a, b"], found) for number, found in FOUND.items())
    assert case_log.known(tmp_path) == FOUND
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines(keepends=True)
    for at in range(1, len(lines)):
        damaged = lines[at].replace("1.0", "1.5")
        path.write_text("".join([*lines[:at], damaged, *lines[at + 1 :]]), encoding="utf-8")
        assert case_log.known(tmp_path) == {k: each for k, each in FOUND.items() if k != at - 1}
    path.write_bytes(text.encode()[:-20])
    assert case_log.known(tmp_path) == {k: each for k, each in FOUND.items() if k != 4}


@pytest.mark.parametrize("setting", ["1 Hz", "10 Hz"])
def test_what_a_kill_left_of_a_line_is_cut_off_alone(tmp_path: Path, setting: str) -> None:
    path = tmp_path / "part_0.csv"
    with CaseLog(path, ["drive.frequency"]) as book:
        book.add([(0, [setting], FOUND[0])])
    whole = path.read_bytes()
    path.write_bytes(whole + b"1,unfinish")
    with CaseLog(path, ["drive.frequency"]) as book:
        book.add([(1, [setting], FOUND[1])])
    assert path.read_bytes().startswith(whole)
    assert path.read_bytes().count(b"\n") == whole.count(b"\n") + 1
    assert case_log.known(tmp_path) == {k: FOUND[k] for k in (0, 1)}
