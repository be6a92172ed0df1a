import argparse
import errno
import gc
import logging
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.runtime import UserError, cli

LOG = logging.getLogger("pipeline.toy")
Output = pytest.CaptureFixture[str]
ARGUMENTS = ("--problem", "problem.yaml")


def run(error: BaseException | None, *options: str) -> int:
    def work(args: argparse.Namespace) -> None:
        LOG.info("working on %s", args.problem)
        LOG.debug("details")
        if error is not None:
            raise error

    parser = cli.parser("pipeline.toy", "Do nothing.")
    return cli.run(work, parser, [*ARGUMENTS, *options])


@pytest.mark.parametrize(
    ("error", "code", "told"),
    [
        (None, 0, ""),
        (UserError("it is wrong", file="a.yaml", remedy="mend it"), 2, "error: it is wrong\n"),
        (OSError(errno.ENOSPC, "full", "/results"), 1, "error: the disk is full\n"),
        (OSError(errno.EROFS, "ro", "/results"), 1, "error: the file system is read-only\n"),
        (FileNotFoundError(errno.ENOENT, "No such file", "/a"), 1, "error: No such file\n"),
        (OSError("odd"), 1, "error: odd\n"),
        (MemoryError(), 1, "error: the memory is full\n"),
        (KeyboardInterrupt(), 130, "interrupted: run the same command again to finish\n"),
        (ZeroDivisionError("by 0"), 1, "error: a bug: ZeroDivisionError: by 0"),
    ],
)
def test_every_end_has_its_code_and_words(
    error: BaseException | None, code: int, told: str, tmp_path: Path, capsys: Output
) -> None:
    log = tmp_path / "logs" / "toy.log"
    assert run(error, "--log", str(log)) == code
    printed = capsys.readouterr()
    assert printed.err.startswith(f"working on problem.yaml\n{told}")
    assert not printed.out
    assert "Traceback" not in printed.err
    kept = log.read_text(encoding="utf-8")
    assert "working on problem.yaml" in kept
    assert "details" in kept
    assert told in kept
    bug = error is not None and isinstance(error, OSError | MemoryError | ZeroDivisionError)
    assert ("Traceback" in kept) == bug


def test_quiet_prints_errors_only(capsys: Output) -> None:
    run(None, "--quiet")
    assert not capsys.readouterr().err
    run(UserError("wrong"), "--quiet")
    assert capsys.readouterr().err == "error: wrong\n"


def test_a_bug_names_the_log_or_shows_its_traceback(tmp_path: Path, capsys: Output) -> None:
    log, bug = tmp_path / "toy.log", ZeroDivisionError("by 0")
    line = f"error: a bug: ZeroDivisionError: by 0; its traceback is in {log}\n"
    for number in (1, 2):
        assert run(bug, "--log", str(log), "--quiet") == 1
        assert capsys.readouterr().err == line
        assert log.read_text(encoding="utf-8").count("working on") == number
    assert run(bug) == 1
    assert "Traceback" in capsys.readouterr().err
    (tmp_path / "file").touch()
    assert run(None, "--log", str(tmp_path / "file" / "toy.log")) == 2
    assert capsys.readouterr().err.startswith("error: ")


def test_a_module_that_is_there_keeps_nothing_from_being_freed() -> None:
    name = "pipeline.stages.select"
    first = cli.imported(name)
    kept = gc.get_freeze_count()
    made_since: list[list[int]] = [[] for _ in range(1000)]
    assert cli.imported(name) is first
    assert gc.get_freeze_count() < kept + len(made_since)


def test_an_error_shows_only_what_it_knows() -> None:
    assert str(UserError("wrong")) == "wrong"
    whole = UserError("wrong", file="a.yaml", line=3, key="b", value="x" * 999, remedy="mend it")
    *lines, value, remedy = str(whole).splitlines()
    assert lines == ["wrong", "  file:   a.yaml, line 3", "  key:    b"]
    assert value.startswith("  value:  'xxx")
    assert len(value) < 140
    assert remedy == "  remedy: mend it"


TERMINATED = """
import os, signal, sys, threading
from pathlib import Path
from pipeline.runtime import cli

cli.GRACE, held = 1, threading.Lock()

def work(args):
    held.acquire()
    try:
        os.kill(os.getpid(), signal.SIGTERM)
    finally:
        Path(sys.argv[1]).touch()
        if "stuck" in sys.argv[1]:
            held.acquire()

sys.exit(cli.run(work, cli.parser("toy", "Do.", study=False), []))
"""


@pytest.mark.parametrize(
    ("name", "code"), [("put away", 128 + signal.SIGTERM), ("stuck", -signal.SIGALRM)]
)
def test_a_termination_unwinds_or_ends_in_a_lock(tmp_path: Path, name: str, code: int) -> None:
    command = [sys.executable, "-c", TERMINATED, str(tmp_path / name)]
    done = subprocess.run(
        command, capture_output=True, env=dict(os.environ), check=False, timeout=60
    )
    assert done.returncode == code
    assert (tmp_path / name).exists()


CLOSED = """
import os, sys
for number in (0, 1, 2):
    os.close(number)
os.execv(sys.argv[1], [sys.argv[1], "-c", sys.argv[2], sys.argv[3]])
"""
STAGE = """
import os, sys
from pathlib import Path
from pipeline.runtime import cli
def work(args):
    with open(args.out, "w") as file:
        os.write(2, b"a library complains")
        print("so does Python", file=sys.stderr)
        cli.logging.getLogger("pipeline").warning("and the stage")
        file.write(f"whole {file.fileno() > 2}")
made = cli.parser("stage", "", study=False)
made.add_argument("out")
sys.exit(cli.run(work, made, sys.argv[1:]))
"""


def test_messages_of_a_process_without_streams_go_nowhere(tmp_path: Path) -> None:
    out = tmp_path / "out.txt"
    command = [sys.executable, "-c", CLOSED, sys.executable, STAGE, str(out)]
    subprocess.run(command, check=True)
    assert out.read_text(encoding="utf-8") == "whole True"


@pytest.mark.parametrize("module", ["pipeline", "reports"])
@pytest.mark.parametrize("words", [["--help"], ["design", "--help"]])
def test_a_reader_that_stops_gets_no_traceback(module: str, words: list[str]) -> None:
    """As `metacloak --help | head` does."""
    running = subprocess.Popen(
        [sys.executable, "-m", module, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert running.stdout is not None
    running.stdout.close()
    assert running.stderr is not None
    told = running.stderr.read().decode()
    running.wait()
    assert "Traceback" not in told
    assert "BrokenPipe" not in told


LEAVING = """
import atexit, threading, time
from pipeline.runtime import cli

class Heavy:
    def __del__(self):
        print("taken apart")

def late():
    time.sleep(0.2)
    print("of the thread")

heavy = Heavy()
atexit.register(print, "of the end")
print("not flushed", end="; ")
threading.Thread(target=late).start()
cli.leave(3)
"""


def test_threads_end_and_the_registered_is_called_and_objects_are_left() -> None:
    words = [sys.executable, "-c", LEAVING]
    ended = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 3, ended.stderr
    assert ended.stdout == "not flushed; of the thread\nof the end\n"
