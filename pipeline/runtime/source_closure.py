"""Hashes the source files that decide what a stage does, found through its import statements.

Snakemake does not see an edit in an imported module; a hash of these files among a rule's params
makes it see. They are kept among the caches beside a hash of the whole source tree, as following
imports takes half as long as all else that Snakemake does before it finds nothing to be done.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

from pipeline.runtime.locations import CACHE, ROOT
from sim.core import PACKAGES, import_closure, locate

_C = {".c", ".h"}
_SHOWN = {".css", ".html", ".j2", ".js", ".mplstyle", ".svg"}
RESOURCES = _C | _SHOWN | {".csv", ".json", ".toml", ".yaml"}


@cache
def source_hash(module: str, root: Path = ROOT) -> str:
    """Hashes the source of a module and of everything of this project that it imports."""
    store = (CACHE if root == ROOT else root / ".cache") / "source_hashes.json"
    known = _stored_hashes(store, _tree_hash(root))
    if module not in known:
        known[module] = _digest(source_files(module, root), root)
        _store_hashes(store, {"tree": _tree_hash(root), "hashes": known})
    return known[module]


@cache
def _tree_hash(root: Path) -> str:
    """Hashes all that a closure can hold: every source file and resource of the packages."""
    kinds = RESOURCES | {".py", ".pyi"}
    walks = (os.walk(root / package) for package in PACKAGES)
    files = (Path(folder, name) for walk in walks for folder, _, names in walk for name in names)
    return _digest(sorted(file for file in files if file.suffix in kinds), root)


def _stored_hashes(store: Path, tree: str) -> dict[str, str]:
    try:
        kept = json.loads(store.read_bytes())
        return dict(kept["hashes"]) if kept["tree"] == tree else {}
    except (OSError, ValueError, KeyError, TypeError):
        return {}


def _store_hashes(store: Path, hashes: dict[str, object]) -> None:
    aside = store.with_name(f".part_{os.getpid()}_{store.name}")
    with suppress(OSError):  # a folder that is read-only: they are computed each time
        store.parent.mkdir(parents=True, exist_ok=True)
        aside.write_text(json.dumps(hashes), encoding="utf-8")
        aside.replace(store)


@cache
def source_files(module: str, root: Path = ROOT) -> tuple[Path, ...]:
    """Lists the files whose content decides what `python -m module` does, sorted.

    These are the modules reached by import statements, at any depth and inside functions too, the
    packages that hold them, and the resources (templates, styles) in the folders of those packages;
    one that bears the name of a module beside it goes with that module, unless it is of C, whose
    files use each other. A name that is imported
    from a lazy package leads to the module that its stub names.

    Raises:
        ModuleNotFoundError: there is no such module below `root`.
    """
    if locate(module, root) is None:
        raise ModuleNotFoundError(f"no module {module!r} below {root}", name=module)
    modules = import_closure([module], root)
    packages = {path.parent for path in modules.values() if path.name == "__init__.py"}
    found = set(modules.values())
    resources = (file for package in packages for file in _resources(package))
    module_of = {file: file.with_suffix(".py") for file in resources}
    own = {
        file
        for file, module in module_of.items()
        if module in found or not module.exists() or file.suffix in _C
    }
    return tuple(sorted(found | own))


def _digest(files: Iterable[Path], root: Path) -> str:
    digest = hashlib.sha256()
    for path in files:
        content = path.read_bytes()
        digest.update(f"{path.relative_to(root).as_posix()} {len(content)}\n".encode() + content)
    return digest.hexdigest()[:16]


def _resources(folder: Path) -> Iterator[Path]:
    """Finds the resources in a package's folder and in its subfolders that are no packages."""
    for path in sorted(folder.iterdir()):
        if path.is_dir() and not (path / "__init__.py").exists():
            yield from _resources(path)
        elif path.suffix in RESOURCES:
            yield path
