"""A stage that a server runs behaves as one that runs by itself, however it ends."""

import atexit
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from pipeline.runtime import ROOT, cli, stage_server

PROGRAM = """
import os, signal, sys, time
from pathlib import Path
print("out of", Path.cwd().name, os.environ["COLOUR"], "server" in os.environ, sys.argv[1:])
print("complains", file=sys.stderr)
what = sys.argv[1]
if what == "sleep":
    try:
        Path("process").write_text(str(os.getpid()))
        time.sleep(60)
    except KeyboardInterrupt:
        sys.exit(130)
if what == "segfault":
    os.kill(os.getpid(), signal.SIGSEGV)
if what == "killed":
    os.kill(os.getpid(), signal.SIGKILL)
sys.exit(int(what))
"""
CLIENT = """
import sys
from pipeline.runtime import delegate
code = delegate("program", "colorsys")
sys.exit(99 if code is None else code)
"""
WORKFLOW = """
import signal, subprocess, sys
from pipeline.runtime import stage_server
stage_server.start()
subprocess.Popen([sys.executable, "-c", sys.argv[1], "sleep"])
signal.pause()
"""
IMPORTS = """
import importlib, os, pipeline
from pipeline.runtime import STAGES
from reports.catalogue import REPORTS
for row in [*STAGES.values(), *REPORTS.values()]:
    importlib.import_module(row.module)
print(len(os.listdir("/proc/self/task")))
"""
NO_FIRST_FORK = """
fork = os.fork

def refuse() -> int:
    os.fork = fork
    raise BlockingIOError("no process is left")

os.fork = refuse
"""
ENVIRONMENT = os.environ | {"COLOUR": "orange", "PYTHONPATH": str(ROOT)}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "program.py").write_text(PROGRAM)
    return tmp_path


@pytest.fixture
def lack() -> str:
    """Says in Python what the server's machine lacks: nothing, unless a test says it."""
    return ""


@pytest.fixture
def server(folder: Path, lack: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Runs a server until the test is over, in which `program` can be imported."""
    if lack:
        (folder / "sitecustomize.py").write_text(f"import os\n{lack}\n")
    monkeypatch.setenv("PYTHONPATH", f"{folder}:{ROOT}")
    monkeypatch.setenv(stage_server.SOCKET, "")
    ended = []
    monkeypatch.setattr(atexit, "register", lambda *call: ended.append(call))
    stage_server.start()
    ENVIRONMENT[stage_server.SOCKET] = os.environ[stage_server.SOCKET]
    yield
    for then, *arguments in reversed(ended):
        then(*arguments)
    assert not Path(ENVIRONMENT[stage_server.SOCKET]).parent.exists()


def client(folder: Path, *words: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", CLIENT, *words]
    pipe = subprocess.PIPE
    return subprocess.Popen(
        command, cwd=folder, env=ENVIRONMENT, text=True, stdout=pipe, stderr=pipe
    )


def sleeping(folder: Path) -> psutil.Process:
    process = folder / "process"
    deadline = time.monotonic() + 30
    while not process.exists() or not process.read_text():
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return psutil.Process(int(process.read_text()))


def test_without_a_socket_stages_run_by_themselves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A folder for temporary files, as clusters have them, is too long a name for one."""
    long = tmp_path / ("scratch" * 20)
    long.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(long))
    monkeypatch.delenv(stage_server.SOCKET, raising=False)
    stage_server.start()
    assert stage_server.SOCKET not in os.environ
    assert "stages start one by one" in caplog.text
    assert not list(long.iterdir())


@pytest.mark.usefixtures("server")
def test_a_stage_has_streams_folder_environment_and_arguments_of_its_client(folder: Path) -> None:
    each = [client(folder, *words) for words in (["3", "a b"], ["0"], ["segfault"])]
    ends = (3, "['3', 'a b']"), (0, "['0']"), (-signal.SIGSEGV, "")
    for process, (code, words) in zip(each, ends, strict=True):
        out, err = process.communicate(timeout=60)
        assert process.returncode == code
        if code < 0:
            continue
        assert out == f"out of {folder.name} orange False {words}\n"
        assert err == "complains\n"


@pytest.mark.usefixtures("server")
@pytest.mark.parametrize(
    ("number", "code"),
    [(signal.SIGTERM, -signal.SIGTERM), (signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)],
)
def test_a_signal_reaches_the_stage(folder: Path, number: int, code: int) -> None:
    process = client(folder, "sleep")
    stage = sleeping(folder)
    process.send_signal(number)
    process.communicate(timeout=30)
    assert process.returncode == code
    if number == signal.SIGKILL:  # the server sees it a little later
        psutil.wait_procs([stage], timeout=30)
    assert not stage.is_running()


@pytest.mark.skipif(sys.platform != "linux", reason="there is no server")
def test_a_killed_workflow_takes_its_stages_along(folder: Path) -> None:
    workflow = subprocess.Popen(
        [sys.executable, "-c", WORKFLOW, CLIENT],
        cwd=folder,
        env=ENVIRONMENT | {"PYTHONPATH": f"{folder}:{ROOT}"},
    )
    stage = sleeping(folder)
    left = psutil.Process(workflow.pid).children(recursive=True)
    assert stage in left
    assert len(left) == 3, "a server, its client and their stage"
    workflow.kill()
    workflow.wait()
    assert not psutil.wait_procs(left, timeout=30)[1]


@pytest.mark.skipif(sys.platform != "linux", reason="there is no server")
def test_a_stage_that_does_not_end_with_its_workflow_is_killed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(cli, "GRACE", 0.1)
    life, held = os.pipe()
    ended, wake = os.pipe()  # the stage alone holds its end: the other is read at its end
    ours, client = socket.socketpair()
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    if not (process := os.fork()):
        os.close(held)  # or the workflow would seem to live
        time.sleep(60)
        os._exit(0)
    signal.signal(signal.SIGTERM, before)
    os.close(wake)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("")
        listener.listen()
        server = stage_server._Server(listener, life, ended)
        server._add_job(stage_server._Job(process, ours))
        os.close(held)
        assert server.serve() is None
    killed = (-signal.SIGKILL).to_bytes(2, signed=True)
    assert client.recv(3) == stage_server._ACCEPTED + killed
    client.close()
    os.close(life)
    os.close(ended)


@pytest.mark.usefixtures("server")
@pytest.mark.parametrize("lack", ["del os.pidfd_open"])
def test_stages_run_where_python_knows_no_descriptors_of_processes(folder: Path) -> None:
    """As those of conda, which are built for old kernels."""
    assert [client(folder, code).wait(60) for code in "03"] == [0, 3]


@pytest.mark.usefixtures("server")
def test_a_stage_that_the_machine_kills_is_told(folder: Path) -> None:
    process = client(folder, "killed")
    told = process.communicate(timeout=60)[1]
    assert process.returncode == -signal.SIGKILL
    assert told == "complains\nkilled, mostly for want of memory\n"


@pytest.mark.skipif(sys.platform != "linux", reason="there is no server")
def test_a_stage_may_end_as_its_client_is_signalled() -> None:
    life, held = os.pipe()
    listener = socket.socket(socket.AF_UNIX)
    listener.bind("")
    listener.listen()
    ended, wake = os.pipe()
    server = stage_server._Server(listener, life, ended)
    ours, client = socket.socketpair()
    if not (process := os.fork()):
        os._exit(3)
    server._add_job(stage_server._Job(process, ours))
    os.waitid(os.P_PID, process, os.WEXITED | os.WNOWAIT)
    os.write(wake, bytes([signal.SIGCHLD]))
    client.sendall(bytes([signal.SIGTERM]))
    os.close(held)
    assert server.serve() is None
    assert client.recv(3) == stage_server._ACCEPTED + (3).to_bytes(2)
    for descriptor in (life, ended, wake):
        os.close(descriptor)
    client.close()


@pytest.mark.usefixtures("server")
@pytest.mark.parametrize("lack", [NO_FIRST_FORK])
def test_a_stage_that_the_server_has_no_process_for_runs_by_itself(folder: Path) -> None:
    assert [client(folder, "3").wait(60) for _ in range(2)] == [99, 3]


@pytest.mark.parametrize("number", [0, signal.SIGTERM])
def test_a_client_does_the_work_itself_whose_server_goes_before(
    folder: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    """Gets the signals itself that were sent meanwhile."""
    monkeypatch.chdir(folder)
    monkeypatch.setitem(ENVIRONMENT, stage_server.SOCKET, "stages")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("stages")
        listener.listen()
        process = client(folder, "0")
        server, _ = listener.accept()
        server.recv(1, socket.MSG_PEEK)
        process.send_signal(number)
        server.close()
    assert process.communicate(timeout=60) == ("", "")
    assert process.returncode == (-number or 99)


@pytest.mark.skipif(sys.platform != "linux", reason="there is no server")
def test_a_stage_ends_with_a_client_that_has_read_nothing() -> None:
    life, held = os.pipe()
    with socket.socket(socket.AF_UNIX) as listener:
        server = stage_server._Server(listener, life, held)
        if not (process := os.fork()):
            signal.pause()
        ours, client = socket.socketpair()
        server._add_job(job := stage_server._Job(process, ours))
        client.close()
        server._forward(job)
        assert os.waitpid(process, 0)[1] == signal.SIGKILL
        ours.close()
    os.close(life)
    os.close(held)


def test_a_client_without_a_server_does_the_work_itself(folder: Path) -> None:
    ENVIRONMENT[stage_server.SOCKET] = str(folder / "nothing")
    process = client(folder, "0")
    process.communicate(timeout=60)
    assert process.returncode == 99


def test_stages_and_pages_leave_the_server_with_one_thread() -> None:
    """A fork has only the thread that forked: whatever another one held stays held."""
    command = [sys.executable, "-c", IMPORTS]
    assert subprocess.check_output(command, cwd=ROOT, text=True) == "1\n"
