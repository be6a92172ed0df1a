"""Runs the stages of a workflow as forks of one process, which imports their libraries once.

A workflow starts a server beside it. `python -m pipeline STAGE` then is a client: it hands its
command line, folder, environment and streams to the server, waits, and ends as the stage ends. The
server imports the stage's module, forks, and the fork does the work as a process of its own. It
forks while it has one thread, so nothing of it may start JAX. Where there is no server (a cluster,
macOS, a command typed by hand) a stage runs by itself.
"""

import atexit
import ctypes
import importlib
import json
import logging
import os
import runpy
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple, cast

from pipeline.runtime import cli, streams

LOG = logging.getLogger(__name__)

SOCKET = "METACLOAK_STAGES"
"""Names the server's socket in the environment of a workflow's jobs."""

_PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of prctl(2)
_STREAMS = (0, 1, 2)
_FORWARDED_SIGNALS = (signal.SIGTERM, signal.SIGINT)
_LENGTH = 8  # bytes that say how long a request is
_ACCEPTED = b"+"  # comes before the exit code, as soon as a stage has a process


class _Request(NamedTuple):
    """Names the program that a client asks for, and what its process has."""

    program: str
    imports: str
    arguments: list[str]
    folder: str
    environment: dict[str, str]


def start(module: str = __name__) -> int | None:
    """Starts the server of this process's jobs; it ends with this process, and its stages too.

    Returns:
        The server's process; None where no socket can be made: jobs do their work themselves.
    """
    if sys.platform != "linux":
        return None
    path = Path(tempfile.mkdtemp(prefix="metacloak-")) / "stages"
    listener = socket.socket(socket.AF_UNIX)
    try:
        listener.bind(str(path))
    except OSError as error:  # a folder for temporary files whose name is longer than a socket's
        LOG.warning("stages start one by one, which takes longer: %s: %s", path, error)
        listener.close()
        path.parent.rmdir()
        return None
    listener.listen(128)
    life, held = os.pipe()  # the server reads its end when this process ends, however it does
    handed = (listener.fileno(), life)
    words = [sys.executable, "-m", module, str(path), *map(str, handed)]
    server = subprocess.Popen(words, pass_fds=handed, stdin=subprocess.DEVNULL)
    atexit.register(server.wait)
    atexit.register(os.close, held)
    os.close(life)
    listener.close()
    os.environ[SOCKET] = str(path)
    return server.pid


def delegate(program: str, imports: str) -> int | None:
    """Has the server run `python -m program` with this process's arguments.

    It imports the module `imports` first, for this stage and those after it.

    Returns:
        The exit code; None where no server takes the work up: the caller does it.
    """
    streams.complete()
    with socket.socket(socket.AF_UNIX) as server:
        try:
            server.connect(os.environ[SOCKET])
        except (KeyError, OSError):
            return None
        request = _Request(program, imports, sys.argv, str(Path.cwd()), dict(os.environ))
        with _forwarding(server):
            if not _is_accepted(server, request):
                return None
            signal.pthread_sigmask(signal.SIG_UNBLOCK, _FORWARDED_SIGNALS)
            code = b""
            with suppress(OSError):  # the server is killed amid the stage, which ends with it
                code = server.recv(2, socket.MSG_WAITALL)
    status = int.from_bytes(code, signed=True) if len(code) == 2 else -signal.SIGKILL
    if status < 0:
        _end_by_signal(-status)
    return status


def _is_accepted(server: socket.socket, request: _Request) -> bool:
    """Sends a request to the server; returns whether this has a process for it."""
    payload = json.dumps(request).encode()
    try:
        socket.send_fds(server, [len(payload).to_bytes(_LENGTH)], _STREAMS)
        server.sendall(payload)
        return server.recv(len(_ACCEPTED)) == _ACCEPTED
    except OSError:  # the server has gone
        return False


def _end_by_signal(number: int) -> None:
    """Ends this process by the signal that ended its stage."""
    if number == signal.SIGKILL:  # which has its one way to be handled, and tells nothing itself
        print("killed, mostly for want of memory", file=sys.stderr, flush=True)  # noqa: T201
    else:
        signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)


@contextmanager
def _forwarding(server: socket.socket) -> Iterator[None]:
    """Forwards signals to the stage, which is in a group of its own: each reaches it once.

    They begin blocked: none can come before the request that it belongs to, and this process gets
    itself those that come before somebody takes it up.
    """

    def forward(number: int, _: object) -> None:
        with suppress(OSError):
            server.sendall(bytes([number]))

    signal.pthread_sigmask(signal.SIG_BLOCK, _FORWARDED_SIGNALS)
    before = {number: signal.signal(number, forward) for number in _FORWARDED_SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _FORWARDED_SIGNALS)


class _Job(NamedTuple):
    """A stage at work: its process, and the client that waits for it."""

    process: int
    client: socket.socket


class _Server:
    """Forks a process for every request, and sends its client the exit code.

    Args:
        listener: takes the clients.
        life: descriptor that can be read once the workflow has ended.
        ended: descriptor that can be read when a stage may have.
    """

    def __init__(self, listener: socket.socket, life: int, ended: int) -> None:
        self._selector = selectors.DefaultSelector()
        self._jobs: set[_Job] = set()
        self._patience: float | None = None  # seconds that stages get to end by themselves
        self._listener, self._parent_pipe, self._child_ended = listener, life, ended
        self._register(listener.fileno(), self._accept)
        self._register(life, self._finish)
        self._register(ended, self._reap)

    def serve(self) -> _Request | None:
        """Serves until the workflow has ended, and its stages. In a fork: returns what to run."""
        while self._listener.fileno() >= 0 or self._jobs:
            ready = self._selector.select(self._patience)
            if not ready:
                self._signal_stages(signal.SIGKILL)
            for key, _ in ready:
                if self._selector.get_map().get(key.fd) is not key:  # its stage has just ended
                    continue
                if request := key.data():
                    return cast(_Request, request)
        return None

    def _register(self, descriptor: int, then: Callable[[], _Request | None]) -> None:
        self._selector.register(descriptor, selectors.EVENT_READ, then)

    def _finish(self) -> None:
        """Ends the stages of a workflow that was killed: one that ends by itself has none left."""
        self._selector.unregister(self._parent_pipe)
        self._selector.unregister(self._listener)
        self._listener.close()
        self._patience = cli.GRACE
        self._signal_stages(signal.SIGTERM)

    def _signal_stages(self, number: int) -> None:
        for job in self._jobs:
            os.kill(job.process, number)

    def _accept(self) -> _Request | None:
        client, _ = self._listener.accept()
        received = _receive_request(client)
        if received is None:
            client.close()
            return None
        request, given = received
        with suppress(Exception):  # the fork meets the same fault, and tells it
            importlib.import_module(request.imports)
        process = _fork()
        if process == 0:
            self._close_inherited()
            _adopt(request, given)
            return request
        for stream in given:
            os.close(stream)
        if process is None:  # the client sees that nobody takes its work up
            client.close()
        else:
            self._add_job(_Job(process, client))
        return None

    def _add_job(self, job: _Job) -> None:
        self._jobs.add(job)
        with suppress(OSError):  # a client that has gone is seen to have
            job.client.sendall(_ACCEPTED)
        self._register(job.client.fileno(), lambda: self._forward(job))

    def _close_inherited(self) -> None:
        """Closes, in a fork, what belongs to the server and to other stages."""
        os.close(signal.set_wakeup_fd(-1))
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        for key in list(self._selector.get_map().values()):
            os.close(key.fd)
        self._selector.close()

    def _forward(self, job: _Job) -> None:
        """Forwards a client's signals to its stage, which is killed if the client has gone."""
        numbers = b""
        with suppress(OSError):  # it is killed before it has read what it was sent
            numbers = job.client.recv(16)
        for number in numbers or [signal.SIGKILL]:
            os.kill(job.process, number)
        if not numbers:
            self._selector.unregister(job.client)

    def _reap(self) -> None:
        """Reaps all stages that have ended, and notifies their clients: signals may come as one."""
        os.read(self._child_ended, 4096)
        for job in list(self._jobs):
            process, status = os.waitpid(job.process, os.WNOHANG)
            if process:
                self._notify(job, os.waitstatus_to_exitcode(status))

    def _notify(self, job: _Job, code: int) -> None:
        with suppress(KeyError):
            self._selector.unregister(job.client)
        with suppress(OSError):
            job.client.sendall(code.to_bytes(2, signed=True))
        job.client.close()
        self._jobs.discard(job)


def _receive_request(client: socket.socket) -> tuple[_Request, list[int]] | None:
    """Reads a request and the streams that come with it; None if the client has gone."""
    head, given, _, _ = socket.recv_fds(client, _LENGTH, len(_STREAMS))
    length = int.from_bytes(head)
    body = client.recv(length, socket.MSG_WAITALL) if length else b""
    if len(given) < len(_STREAMS) or len(body) < length:
        for stream in given:
            os.close(stream)
        return None
    return _Request(*json.loads(body)), list(given)


def _fork() -> int | None:
    """Forks as `os.fork` does; None where the machine has no process or no memory left for it."""
    with suppress(OSError):
        return os.fork()
    return None


def _adopt(request: _Request, given: list[int]) -> None:
    """Adopts, in a fork, the streams, folder, environment and arguments of its client."""
    ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, signal.SIGTERM)
    os.setpgid(0, 0)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for stream, own in zip(given, _STREAMS, strict=True):
        os.dup2(stream, own)
        os.close(stream)
    os.chdir(request.folder)
    os.environ.clear()
    os.environ.update(request.environment)
    os.environ.pop(SOCKET, None)
    sys.argv = request.arguments


def _ended_children() -> int:
    """Makes a descriptor that can be read when a child of this process has ended.

    By the signal, which every kernel and container has: they may lack or refuse pidfd_open(2).
    """
    ended, wake = os.pipe()
    os.set_blocking(wake, False)
    signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    signal.signal(signal.SIGCHLD, lambda *_: None)  # one that is ignored or default wakes nobody
    return ended


def serve(path: Path, listener: int, life: int) -> None:
    """Serves requests at the socket `path`; returns at its end, or its program's in a fork."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    request = _Server(socket.socket(fileno=listener), life, _ended_children()).serve()
    if request is not None:
        runpy.run_module(request.program, run_name="__main__", alter_sys=True)
        return
    path.unlink(missing_ok=True)
    path.parent.rmdir()


if __name__ == "__main__":
    serve(Path(sys.argv[1]), *map(int, sys.argv[2:4]))
    cli.leave(0)
