"""Sets how a process of this project runs: one thread, fixed seeds and instructions, own caches.

Small systems lose up to thirty times their speed to threads of BLAS and XLA, and results are only
byte-reproducible without them; work is spread over cores as processes instead. The libraries read
these variables once, when they are imported, so `pipeline` sets them on its own import.
"""

import getpass
import os
from contextlib import suppress
from pathlib import Path

import platformdirs

from pipeline.runtime.locations import CACHE
from sim.core import TEMPORARY_NAME, instruction_set, make_temporary_folder

RUN_MARK = "METACLOAK_RUN"
"""Names folder and run (FOLDER:NUMBER on HOST) in the environment of all jobs."""

ONE_THREAD = {
    "MKL_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
}
REPRODUCIBLE = {
    "JAX_PLATFORMS": "cpu",
    "MPLBACKEND": "agg",
    "PYTHONHASHSEED": "0",
    "SOURCE_DATE_EPOCH": "1735689600",  # 2025-01-01, the date that files with a date carry
}
BOUNDED = {
    "OPENCV_IO_MAX_IMAGE_PIXELS": str(1 << 27),  # of a picture: more are refused, not allocated
}
CACHES = {
    "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
    "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
    "MPLCONFIGDIR": str(CACHE / "matplotlib"),
}


def pin() -> None:
    """Sets the variables here and for child processes; caches asked for elsewhere stay there."""
    os.environ.update(ONE_THREAD | REPRODUCIBLE | BOUNDED)
    if instruction_set.can_pin():
        os.environ.update(instruction_set.LIBRARIES)
        os.environ["XLA_FLAGS"] += f" {instruction_set.XLA_FLAG}"
    _set_user_name()
    _set_cache_folder()
    # found by content, so from any checkout
    jax = {"JAX_COMPILATION_CACHE_DIR": str(platformdirs.user_cache_path("metacloak") / "jax")}
    for name, value in (CACHES | jax).items():
        os.environ.setdefault(name, value)


def _set_user_name() -> None:
    """Names the user by number where the machine knows no name, as in a container: snakemake asks.

    The list of users has no entry for it then; Python 3.13 tells so by another error.
    """
    try:
        getpass.getuser()
    except (KeyError, OSError):
        os.environ["LOGNAME"] = str(os.getuid())


def _set_cache_folder() -> None:
    """Names a folder below TMPDIR for all caches of the user, where theirs cannot be written.

    It is also the home of a user who has none, whose caches then lie there.

    The machine that submitted this job may have named one, which is not looked for on this one.
    """
    for name in ("HOME", "XDG_CACHE_HOME", "JAX_COMPILATION_CACHE_DIR"):
        if TEMPORARY_NAME in Path(os.environ.get(name, "")).parts:
            del os.environ[name]
    with suppress(OSError):
        if not _has_home():
            os.environ["HOME"] = str(make_temporary_folder())
        if not _is_writable(platformdirs.user_cache_path()):
            os.environ["XDG_CACHE_HOME"] = str(make_temporary_folder())


def _has_home() -> bool:
    try:
        Path.home()
    except RuntimeError:
        return False
    return True


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)
