"""Locates compiled loops by what they are made of, so that a machine compiles each of them once.

Numba files a loop by the path of its source, and takes it for current as long as that file is: a
second checkout compiles anew, and an edit in a file that the loop calls goes unseen. Here a loop is
filed by a hash of its file and of all that this imports; Numba itself adds its version, the
signature, and the processor's features.
"""

from __future__ import annotations

import hashlib
import logging
import os
import pickle
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numba.core.config
import platformdirs
from numba.core.caching import FunctionCache, _CacheLocator

from sim.core.import_graph import file_closure
from sim.core.instruction_set import LEVEL, can_pin
from sim.core.temporary_folder import make_temporary_folder

LOG = logging.getLogger(__name__)

ROOT = Path(__file__).resolve().parents[2]
_NUMBA_OWN = (
    "UserProvidedCacheLocator,InTreeCacheLocator,UserWideCacheLocator,IPythonCacheLocator,"
    "ZipCacheLocator"
)


class SourceHashLocator(_CacheLocator):
    """Locates the cache of one loop of this project; others keep Numba's own places."""

    def __init__(self, function: Callable[..., Any], file: Path, folder: Path) -> None:
        module = ".".join(file.relative_to(ROOT).with_suffix("").parts)
        self._hash = loop_hash(file)
        self._folder = folder / f"{module}-{self._hash}"
        self._line = function.__code__.co_firstlineno
        self._py_file = str(file)  # Numba names it in its warning of a loop that cannot be cached

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> SourceHashLocator | None:
        """Makes the locator of a loop; None where it is none of ours.

        Numba's own places would take what changed in another file for current: none is left to it.

        Raises:
            OSError: no folder can be written.
        """
        path = Path(file).resolve()
        if not _is_ours(path):
            return None
        for folder in cache_folders():
            located = cls(function, path, folder)
            with suppress(OSError):
                located.ensure_cache_path()  # type: ignore[no-untyped-call]
                return located
        raise OSError(
            f"compiled loops can be kept neither in {cache_folder()} nor in a folder of your own"
            f" below {tempfile.gettempdir()}; name another one by NUMBA_CACHE_DIR"
        )

    def get_cache_path(self) -> str:
        """Names the folder of the loop's machine code."""
        return str(self._folder)

    def get_source_stamp(self) -> str:
        """Returns the hash of the loop's sources."""
        return self._hash

    def get_disambiguator(self) -> str:
        """Tells loops of the same name in one file apart, by their line."""
        return str(self._line)


class LoopCache(FunctionCache):
    """Keeps the machine code of a loop; does without what cannot be read or written."""

    def load_overload(self, sig: object, target_context: object) -> Any:  # noqa: ANN401
        """Reads what was compiled for a signature; None where that is to be done."""
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except (EOFError, pickle.UnpicklingError):
            LOG.warning("damaged files in %s: compiling that loop again", self.cache_path)
        for path in Path(self.cache_path).glob(f"{self._impl.filename_base}.*"):
            path.unlink(missing_ok=True)
        return None

    def save_overload(self, sig: object, data: object) -> None:
        """Writes what was compiled for a signature, where there is room."""
        try:
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except OSError as error:
            _tell_unkept(str(Path(self.cache_path).parent), error.strerror)


@cache
def _tell_unkept(folder: str, reason: str) -> None:
    LOG.warning("no compiled loops can be kept in %s, each run compiles again: %s", folder, reason)


def _is_ours(file: Path) -> bool:
    """Tells files of the checkout from what is installed, in an environment within it too."""
    if not file.is_relative_to(ROOT) or not file.is_file():
        return False
    return "site-packages" not in file.relative_to(ROOT).parts


@cache
def loop_hash(file: Path, root: Path = ROOT) -> str:
    """Hashes the file of a loop and what it imports: constants and callees are compiled into it."""
    digest = hashlib.sha256()
    for name, path in sorted(file_closure(file, root).items()):
        content = path.read_bytes()
        digest.update(f"{name} {len(content)}\n".encode() + content)
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Returns the folder of all compiled loops: NUMBA_CACHE_DIR, or one of the user's caches."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    return Path(named) if named else platformdirs.user_cache_path("metacloak") / "loops"


def cache_folders() -> Iterator[Path]:
    """Lists that folder and, where it cannot be written, one of the user's for temporary files."""
    yield cache_folder()
    with suppress(OSError):
        yield make_temporary_folder() / "loops"


def install() -> None:
    """Makes Numba ask this locator and keep to the level, unless the user named others."""
    config: Any = numba.core.config
    if config.CPU_NAME is None and can_pin():
        config.CPU_NAME, config.CPU_FEATURES = LEVEL, ""  # the level's own
    if not config.CACHE_LOCATOR_CLASSES:
        config.CACHE_LOCATOR_CLASSES = f"{__name__}.SourceHashLocator,{_NUMBA_OWN}"
