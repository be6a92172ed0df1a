"""Hashes the source files that decide what a stage does, found through its import statements.

Snakemake does not see an edit in an imported module; a hash of these files among a rule's params
makes it see.
"""

import hashlib
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from pipeline.runtime.locations import ROOT
from sim.core import import_closure, locate

RESOURCES = {".css", ".csv", ".html", ".j2", ".js", ".json", ".mplstyle", ".svg", ".yaml"}


@cache
def source_hash(module: str, root: Path = ROOT) -> str:
    """Hashes the source of a module and of everything of this project that it imports."""
    return _digest(source_files(module, root), root)


@cache
def source_files(module: str, root: Path = ROOT) -> tuple[Path, ...]:
    """Lists the files whose content decides what `python -m module` does, sorted.

    These are the modules reached by import statements, at any depth and inside functions too, the
    packages that hold them, and the resources (templates, styles) in the folders of those packages;
    one that bears the name of a module beside it goes with that module. A name that is imported
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
    own = {file for file, module in module_of.items() if module in found or not module.exists()}
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
