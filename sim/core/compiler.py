"""Compiles a folder's files of C, once on a machine, and loads them.

What is compiled lies among the user's caches under a hash of all that it is made of, so that each
checkout, script and process finds it.
"""

import ctypes
import errno
import fcntl
import hashlib
import logging
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TextIO

import platformdirs

from sim.core import compile_time
from sim.core.instruction_set import LEVEL, can_pin
from sim.core.temporary_folder import make_temporary_folder

LOG = logging.getLogger(__name__)

_FLAGS = (
    *("-std=c11", "-O3", "-fPIC", "-shared"),
    # the same bits by every compiler: no fused products, no other order of sums
    *("-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"),
)

_OF_LEVEL = ("-mavx2", "-mfma", "-mbmi", "-mbmi2", "-mf16c", "-mlzcnt", "-mmovbe")
"""The level, as compilers spell it that do not know its name (before gcc 11 and clang 12)."""
_SHARED = Path(__file__).parent
"""Holds the headers that any library may include, as `sim/core/numbers.h`."""
_TRIAL_SOURCE = """#include <math.h>
#include <stdint.h>

int32_t trial(double x) { return (int32_t)sqrt(x); }
"""
"""Tells a compiler that works from one without the headers of C, or without its linker."""
_DISK_FULL = "No space left on device", "Disk quota exceeded"


_INSTALL_REMEDY = (
    "install a compiler and the headers of C: `apt install gcc libc6-dev`, `dnf install gcc"
    " glibc-devel`, `xcode-select --install`, or `pip install ziglang`; CC names another"
)
_COMPILER_REMEDY = "set CC to a compiler of C, as `gcc`, or unset it"
_FOLDER_REMEDY = "set XDG_CACHE_HOME or TMPDIR to a folder with room, from which code may be run"


class CompilerError(RuntimeError):
    """Reports that C cannot be compiled, with a remedy."""

    def __init__(self, what: str, remedy: str = _INSTALL_REMEDY) -> None:
        super().__init__(what)
        self.remedy = remedy


def load(folder: Path, flags: tuple[str, ...] = ()) -> ctypes.CDLL:
    """Loads the library of a folder, compiled before or now, with `flags` besides those of all.

    Raises:
        CompilerError: there is no compiler, it fails, or what it makes cannot be kept.
    """
    arguments = [*options(), *flags]
    name = f"{folder.name}-{_digest(folder, arguments)}.so"
    for place in cache_folders():  # in all before any is tried again that was of no use before
        if loaded := _load_compiled(place / name):
            return loaded
    failures: list[str] = []
    for place in cache_folders():
        try:
            place.mkdir(parents=True, exist_ok=True)
            return _load(folder, place / name, arguments)
        except OSError as error:  # not to be written, or no code may be run from there
            failures.append(str(error))
    reason = f"what is compiled can be kept nowhere: {'; '.join(failures)}"
    raise CompilerError(reason, _FOLDER_REMEDY)


def sources(folder: Path) -> list[Path]:
    """Lists a folder's files of C, headers among them."""
    return sorted([*folder.rglob("*.c"), *folder.rglob("*.h")])


def cache_folders() -> Iterator[Path]:
    """Lists the folder of what is compiled and, where that cannot be used, one for a while."""
    with suppress(RuntimeError):  # the user has no home
        yield platformdirs.user_cache_path("metacloak") / "compiled"
    with suppress(OSError):
        yield make_temporary_folder() / "compiled"


def _load(folder: Path, library: Path, arguments: list[str]) -> ctypes.CDLL:
    """Compiles a library in its place, unless another process does, and loads it."""
    with compile_time.counted(), library.with_suffix(".lock").open("w") as lock:
        locks = _acquire(lock)
        if loaded := _load_compiled(library):  # another process has compiled it meanwhile
            return loaded
        LOG.info("compiling %s, once on this machine: some seconds", folder.name)
        if locks:
            for left in library.parent.glob(f"{library.stem}_*"):  # by a process that was killed
                shutil.rmtree(left, ignore_errors=True)
        build_folder = Path(tempfile.mkdtemp(prefix=f"{library.stem}_", dir=library.parent))
        try:
            _install(_compile(folder, build_folder / library.name, arguments), library)
        finally:
            shutil.rmtree(build_folder, ignore_errors=True)
    return ctypes.CDLL(str(library))


def _acquire(lock: TextIO) -> bool:
    """Waits for a file's lock; False where the file system knows none: several may compile then."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
    except OSError:
        return False
    return True


def _load_compiled(library: Path) -> ctypes.CDLL | None:
    """Loads a library that was compiled before; None without one that is complete and runs."""
    if _is_complete(library):
        with suppress(OSError):
            return ctypes.CDLL(str(library))
    return None


def _is_complete(library: Path) -> bool:
    """Tests for a library with the size that was noted: loading part of one kills."""
    try:
        return library.stat().st_size == int(library.with_suffix(".size").read_bytes())
    except (OSError, ValueError):
        return False


def _install(made: Path, library: Path) -> None:
    """Moves a library to its place once it is on the disk, and notes its size."""
    with made.open("rb") as file:
        os.fsync(file.fileno())
    size_file = made.with_suffix(".size")
    size_file.write_text(str(made.stat().st_size), encoding="ascii")
    size_file.replace(library.with_suffix(".size"))
    made.replace(library)


def _compile(folder: Path, library: Path, arguments: list[str]) -> Path:
    files = [str(path) for path in sources(folder) if path.suffix == ".c"]
    chosen = compiler(library.parent)
    if "ziglang" in chosen:  # which else compiles for the processor at hand
        arguments = [
            *arguments,
            f"-march={LEVEL.replace('-', '_')}" if can_pin() else "-mcpu=baseline",
        ]
    return _run_compiler(library, [*chosen, *arguments, f"-I{folder.parent}", *files, "-lm"])


def compiler(place: Path) -> list[str]:
    """Finds a compiler of C: CC, one on the path that works, or the one of the package ziglang.

    Args:
        place: a folder to try those on the path in.

    Raises:
        CompilerError: there is none.
        OSError: the folder is full.
    """
    if named := _split_variable("CC"):
        return named
    (trial := place / "trial.c").write_text(_TRIAL_SOURCE, encoding="ascii")
    failures: list[str] = []
    for name in filter(shutil.which, ("cc", "gcc", "clang")):
        try:
            _run_compiler(trial.with_suffix(".so"), [name, "-shared", "-fPIC", str(trial), "-lm"])
        except CompilerError as error:
            failures.append(str(error))
        else:
            return [name]
    if find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise CompilerError("\n".join(failures) or "no compiler of C is found")


def _run_compiler(library: Path, command: list[str]) -> Path:
    """Has a compiler make a library.

    Raises:
        CompilerError: it cannot be run, fails, or makes none.
        OSError: the library's folder is full.
    """
    command = [*command, "-o", str(library)]
    # room is wanted in one folder only, and the words for a lack of it are to be known
    environment = os.environ | {"TMPDIR": str(library.parent), "LC_ALL": "C"}
    try:
        ended = subprocess.run(
            command, capture_output=True, text=True, check=False, env=environment
        )
    except OSError as error:
        raise CompilerError(f"{command[0]} cannot be run: {error.strerror}") from error
    if any(words in ended.stderr for words in _DISK_FULL):
        raise OSError(errno.ENOSPC, f"{library.parent} is full")
    if ended.returncode:
        raise CompilerError(f"{shlex.join(command)}\n{ended.stderr.strip()}")
    if not library.exists():
        raise CompilerError(f"{shlex.join(command)}\nmade no library", _COMPILER_REMEDY)
    return library


def options() -> list[str]:
    """Lists the compiler's options; those of METACLOAK_CFLAGS come last."""
    return [
        *_FLAGS,
        *(_OF_LEVEL if can_pin() else ()),
        *_split_variable("METACLOAK_CFLAGS"),
    ]


def _split_variable(variable: str) -> list[str]:
    """Splits a variable of the environment into words, as a shell does.

    Raises:
        CompilerError: a quotation in it has no end.
    """
    text = os.environ.get(variable, "")
    try:
        return shlex.split(text)
    except ValueError as error:
        raise CompilerError(f"{variable} is {text}: {error}", f"mend {variable}") from error


def _digest(folder: Path, arguments: list[str]) -> str:
    """Hashes all that a library is made of."""
    made_for = (platform.system(), platform.machine(), *platform.libc_ver())
    arguments = [*arguments, os.environ.get("CC", "")]
    digest = hashlib.sha256(" ".join([*arguments, *made_for]).encode())
    for path in [*sources(folder), *sorted(_SHARED.glob("*.h"))]:
        content = path.read_bytes()
        digest.update(f"{path.name} {len(content)}\n".encode() + content)
    return digest.hexdigest()[:16]
