"""Sets up an environment from locks: by uv, or by pip where uv cannot be had.

``python install_lock.py ENVIRONMENT LOCK...`` needs nothing but a Python with venv and pip. uv
comes from the lock as well; it is told the settings of pip by its environment, since command lines
are seen by others. Byte code is left to the first import, unless Python is told to write none then.
"""

import argparse
import ast
import fcntl
import os
import platform
import re
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from tempfile import NamedTemporaryFile, TemporaryDirectory, TemporaryFile

_UV_NAMES = {
    "index-url": ("UV_DEFAULT_INDEX",),
    "extra-index-url": ("UV_INDEX",),
    "find-links": ("UV_FIND_LINKS",),
    "no-index": ("UV_NO_INDEX",),
    "trusted-host": ("UV_INSECURE_HOST",),
    "cert": ("SSL_CERT_FILE",),
    "client-cert": ("SSL_CLIENT_CERT",),
    "proxy": ("HTTP_PROXY", "HTTPS_PROXY"),
    "timeout": ("UV_HTTP_TIMEOUT",),
    "default-timeout": ("UV_HTTP_TIMEOUT",),
    "retries": ("UV_HTTP_RETRIES",),
}
"""Variables of uv by the settings of pip, in the order in which later ones prevail."""
_SECTIONS = ("global", "install", ":env:")
"""Places of settings of `pip install`, in the order in which later ones prevail."""
_WHEELS = "wheels"
"""Is the file of an environment that holds the path of the folder of packages it came from."""
_LIBRARY = """
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
int32_t whole(double x) { return abs((int32_t)sin(x)); }
"""
"""Needs of a compiler what the solvers need: the headers of the C library, and a linker."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Installs what the environment lacks of the locks, one process at a time.

    Raises:
        SystemExit: something cannot be made or installed, which is told.
    """
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("environment", type=Path, help="made anew unless it holds the first lock")
    parser.add_argument("locks", type=Path, nargs="+", help="pinned packages with hashes")
    parser.add_argument("--wheels", type=Path, help="take all from this folder, without a network")
    parser.add_argument("--compiler", type=Path, help="a lock to add where no compiler of C works")
    asked = parser.parse_args(arguments)
    environment = asked.environment.resolve()  # a link leads to it: venv makes none in its place
    wheels, first = _wheels(asked.wheels, environment), asked.locks[0]
    os.environ.update({"PIP_USER": "0"} | _without_cache())  # an environment has no user's packages
    with _turn(environment):
        for lock in asked.locks:
            # The copy of a lock says what the environment holds; one without was never finished.
            copy = environment / lock.name
            if copy.exists() and copy.read_bytes() == lock.read_bytes():
                copy.touch()
                continue
            _say(f"Setting up {asked.environment} from {lock} (half a minute, once)")
            if lock == first:
                _prepare(environment, copy)
            copy.unlink(missing_ok=True)
            _install(environment, lock, wheels)
            if lock == first and asked.compiler and not has_compiler():
                _say(f"No compiler of C works here: adding the one of {asked.compiler}")
                _install(environment, asked.compiler, wheels)
            shutil.copyfile(lock, copy)
        if wheels:
            (environment / _WHEELS).write_text(str(wheels), encoding="utf-8")


def _wheels(named: Path | None, environment: Path) -> Path | None:
    """Finds the folder of packages: the one that is named, or of an earlier call if still there."""
    if named is None:
        kept = environment / _WHEELS
        folder = Path(kept.read_text(encoding="utf-8")) if kept.exists() else None
        return folder if folder and folder.is_dir() else None
    if not any(named.glob("*.whl")):
        sys.exit(f"error: no packages are in the folder '{named}': make wheels fills one")
    return named.resolve()


def _without_cache() -> dict[str, str]:
    """Returns the variables for uv and pip where the user's folder of caches cannot be written."""
    try:
        folder = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "uv"
        folder.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=folder).close()
    except (OSError, RuntimeError):  # no such folder, and nobody's home
        elsewhere = {"UV_CACHE_DIR", "UV_NO_CACHE", "PIP_CACHE_DIR"} & os.environ.keys()
        return {} if elsewhere else {"UV_NO_CACHE": "1", "PIP_NO_CACHE_DIR": "1"}
    return {}


@contextmanager
def _turn(environment: Path) -> Iterator[None]:
    """Waits until no other process sets up the environment."""
    file = Path(".cache", f"{environment.name}.turn")
    file.parent.mkdir(exist_ok=True)
    with file.open("w") as turn:
        with suppress(OSError):  # a file system without locks: none waits for another
            try:
                fcntl.flock(turn, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                _say(f"Waiting for another process, which sets up {environment.name}")
                fcntl.flock(turn, fcntl.LOCK_EX)
        yield


def _say(what: str) -> None:
    sys.stderr.write(f"{what}\n")


def _prepare(environment: Path, copy: Path) -> None:
    """Makes an environment that was never finished; of another, forgets what it holds."""
    if copy.exists():
        for each in environment.glob("requirements*.lock"):
            each.unlink()
        return
    if not find_spec("ensurepip"):
        sys.exit(
            f"error: '{sys.executable}' comes without venv or pip."
            " On Debian and Ubuntu: apt-get install python3-venv"
        )
    command = [sys.executable, "-m", "venv", "--clear", str(environment)]
    if subprocess.run(command, check=False).returncode:
        sys.exit(f"error: '{sys.executable}' can make no environment in {environment}")


def has_compiler() -> bool:
    """Tells whether CC or a compiler on the path makes such libraries as the solvers are."""
    return any(map(_compiles, (os.environ.get("CC", ""), "cc", "gcc", "clang")))


def _compiles(compiler: str) -> bool:
    with TemporaryDirectory() as folder, suppress(OSError, ValueError):
        library = Path(folder, "library.so")
        words = ["-std=c11", "-shared", "-fPIC", "-x", "c", "-", "-o", str(library), "-lm"]
        command = [*shlex.split(compiler), *words]
        subprocess.run(command, input=_LIBRARY, text=True, capture_output=True, check=False)
        return library.exists()
    return False


def _install(environment: Path, lock: Path, wheels: Path | None) -> None:
    """Installs a lock.

    Raises:
        SystemExit: neither uv nor pip can.
    """
    if _can_install(environment, lock, wheels):
        return
    python = f"Python {sys.version_info.major}.{sys.version_info.minor} on {platform.machine()}"
    packages = f"on a machine with one, for {python}: make wheels WHEELS=folder"
    if wheels:
        sys.exit(
            f"error: {lock} cannot be installed from {wheels}, which has to be made for {python}"
            f" and these locks. That takes a network; {packages}"
        )
    sys.exit(
        f"error: {lock} cannot be installed. If that is for want of a network, {packages};"
        " then here: make setup WHEELS=folder"
    )


def _can_install(environment: Path, lock: Path, wheels: Path | None) -> bool:
    python, uv = environment / "bin/python", environment / "bin/uv"
    where = ["--no-index", "--find-links", str(wheels)] if wheels else []
    install = ["install", "--quiet", "--require-hashes", *where]
    pip = [str(python), "-m", "pip", *install, "--disable-pip-version-check"]
    pip += ["-r"] if sys.dont_write_bytecode else ["--no-compile", "-r"]
    if not _has_uv(pip, lock):  # nor can pip then install the whole
        return False
    if uv.exists():
        words = [str(uv), "pip", *install, "-r", str(lock)]
        words += ["--python", str(python), "--index-strategy", "unsafe-best-match"]
        words += ["--compile-bytecode"] if sys.dont_write_bytecode else []
        if subprocess.run(words, env=_uv_environment(python), check=False).returncode == 0:
            return True
        _say("uv cannot install here, pip does: a few minutes")
    return subprocess.run([*pip, str(lock)], check=False).returncode == 0


def uv_settings(listed: str) -> dict[str, str]:
    """Translates settings of pip, as `pip config list` lists them, to variables of uv.

    Folders of packages that are not there are left out: pip passes over them, uv gives up.
    """
    lines = [line.partition("=")[::2] for line in listed.splitlines()]
    given = {key: ast.literal_eval(value) for key, value in lines if value}
    found = {}
    for section in _SECTIONS:
        for setting, names in _UV_NAMES.items():
            words = str(given.get(f"{section}.{setting}", "")).split()
            if setting == "find-links":
                words = [word for word in words if _is_there(word)]
            separator = "," if setting == "find-links" else " "
            found.update(dict.fromkeys(names, separator.join(words)) if words else {})
    return found


def _is_there(place: str) -> bool:
    return bool(re.match(r"https?:", place)) or Path(place.removeprefix("file://")).exists()


def _uv_environment(python: Path) -> dict[str, str]:
    """Returns the variables for uv: settings of pip, unless its own are there."""
    command = [str(python), "-m", "pip", "config", "list"]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    own = {name: value for name, value in os.environ.items() if name.startswith("UV_")}
    return os.environ | uv_settings(listed) | own


def _has_uv(pip: Sequence[str], lock: Path) -> bool:
    """Installs the uv of a lock; False where it has one that cannot be had."""
    pinned = re.search(r"^uv==(.*\\\n)*.*$", lock.read_text(encoding="utf-8"), re.MULTILINE)
    if pinned is None:
        return True
    with NamedTemporaryFile("w", suffix=".lock") as alone:
        alone.write(pinned[0])
        alone.flush()
        return subprocess.run([*pip, alone.name], check=False).returncode == 0


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        _say("stopped: the same command goes on")
        sys.exit(128 + signal.SIGINT)
