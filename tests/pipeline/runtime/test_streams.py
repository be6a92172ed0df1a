"""A process without standard streams writes no messages into its datasets."""

import subprocess
import sys
from pathlib import Path

import pytest

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
