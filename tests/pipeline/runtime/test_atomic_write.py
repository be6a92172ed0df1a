import os
import subprocess
import sys
from pathlib import Path

from pipeline.runtime import write_atomically
from tests.tables import refused

OTHER = """
import sys
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


def test_what_a_killed_process_left_goes_and_what_a_living_one_writes_stays(
    tmp_path: Path,
) -> None:
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
    with (
        refused("", file=tmp_path / "file/out.txt"),
        write_atomically(tmp_path / "file/out.txt"),
    ):
        pass
