"""The one place that says how a process of this project runs: one thread, fixed seeds, own caches.

Small systems lose up to thirty times their speed to threads of BLAS and XLA, and results are only
byte-reproducible without them; work is spread over cores as processes instead. The libraries read
these variables once, when they are imported, so `pipeline` sets them on its own import.
"""

from __future__ import annotations

import hashlib
import os
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CACHE = ROOT / ".cache"
RUN_MARK = "METACLOAK_RUN"  # names the repository in the environment of every job of a workflow

ONE_THREAD = {
    "MKL_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
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
    "JAX_COMPILATION_CACHE_DIR": str(CACHE / "jax"),
    "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0.1",
    "MPLCONFIGDIR": str(CACHE / "matplotlib"),
}

_LOOP = b"@compiled"
_IMPORT = re.compile(r"^from ((?:sim|pipeline)[\w.]*) import (\([^)]*\)|.*)", re.MULTILINE)
_WORD = re.compile(r"\w+")


def pin() -> None:
    """Sets the variables here and for child processes; caches asked for elsewhere stay there."""
    os.environ.update(ONE_THREAD | REPRODUCIBLE | BOUNDED)
    for name, value in (
        CACHES | {"NUMBA_CACHE_DIR": str(CACHE / "numba" / kernels_hash())}
    ).items():
        os.environ.setdefault(name, value)


def kernels_hash(root: Path = ROOT) -> str:
    """Hash of the files with compiled loops and of what they import: the name of Numba's cache.

    Numba takes a cached loop for current as long as its own file is unchanged, even if another
    file holds what it calls.
    """
    sources = {path.relative_to(root): path.read_bytes() for path in _sources(root)}
    waiting = [path for path, source in sources.items() if b"njit(" in source or _LOOP in source]
    needed: set[Path] = set()
    while waiting:
        path = waiting.pop()
        if path in sources and path not in needed:
            needed.add(path)
            waiting += _imported(sources[path].decode())
    digest = hashlib.sha256()
    for path in sorted(needed):
        digest.update(f"{path.as_posix()} {len(sources[path])}\n".encode() + sources[path])
    return digest.hexdigest()[:16]


def _sources(root: Path) -> list[Path]:
    return [*(root / "sim").glob("*.py"), *(root / "pipeline/tracking").glob("*.py")]


def _imported(source: str) -> list[Path]:
    """Files that may be imported: `from a.b import c` gives a/b.py and a/b/c.py."""
    found = []
    for base, names in _IMPORT.findall(source):
        folder = Path(*base.split("."))
        found += [
            folder.with_suffix(".py"),
            *(folder / f"{name}.py" for name in _WORD.findall(names)),
        ]
    return found
