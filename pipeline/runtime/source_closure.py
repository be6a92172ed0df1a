"""Follows import statements to the source files that decide what a stage or a compiled loop does.

Snakemake does not see an edit in an imported module, and Numba none in another file than a loop's
own; a hash of these files, among a rule's params and in the name of Numba's cache, makes them see.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from pipeline.runtime.locations import PREFIX, ROOT

PACKAGES = ("sim", "pipeline", "reports", "benchmarks")
RESOURCES = {".css", ".csv", ".html", ".j2", ".js", ".json", ".mplstyle", ".svg", ".yaml"}
_LOOPS = ("sim", "pipeline")
_LOOP_MARKS = (b"njit(", b"@compiled", b"@inlined")


@cache
def source_hash(module: str, root: Path = ROOT) -> str:
    """Hashes the source of a module and of everything of this project that it imports."""
    return _digest(source_files(module, root), root)


@cache
def kernels_hash(root: Path = ROOT) -> str:
    """Hashes the files with compiled loops and what they import: the name of Numba's cache."""
    return _digest(loop_files(root), root)


@cache
def loop_files(root: Path = ROOT) -> tuple[Path, ...]:
    """Lists the files with compiled loops and all that they import, sorted."""
    loops = (
        ".".join(path.relative_to(root).with_suffix("").parts)
        for folder in _LOOPS
        for path in (root / folder).rglob("*.py")
        if any(mark in path.read_bytes() for mark in _LOOP_MARKS)
    )
    return tuple(sorted(_closure(loops, root).values()))


@cache
def source_files(module: str, root: Path = ROOT) -> tuple[Path, ...]:
    """Lists the files whose content decides what `python -m module` does, sorted.

    These are the modules reached by import statements, at any depth and inside functions too, the
    packages that hold them, and the resources (templates, styles) in the folders of those packages.
    A name that is imported from a lazy package leads to the module that its stub names.

    Raises:
        ModuleNotFoundError: there is no such module below `root`.
    """
    if _locate(module, root) is None:
        raise ModuleNotFoundError(f"no module {module!r} below {root}", name=module)
    modules = _closure([module], root)
    packages = {path.parent for path in modules.values() if path.name == "__init__.py"}
    resources = (file for package in packages for file in _resources(package))
    return tuple(sorted({*modules.values(), *resources}))


def _digest(files: Iterable[Path], root: Path) -> str:
    digest = hashlib.sha256()
    for path in files:
        content = path.read_bytes()
        digest.update(f"{path.relative_to(root).as_posix()} {len(content)}\n".encode() + content)
    return digest.hexdigest()[:16]


def _closure(modules: Iterable[str], root: Path) -> dict[str, Path]:
    """Maps the names of modules and of all that they import to their files."""
    found: dict[str, Path] = {}
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        path = _locate(name, root)
        if name in found or path is None:
            continue
        found[name] = path
        waiting += _parents(name)
        waiting += _imported(path, name, root)
    return found


@cache
def _locate(module: str, root: Path) -> Path | None:
    """Finds the file of a module of this project; None for what lies outside or is no module."""
    if module.partition(".")[0] not in PACKAGES:
        return None
    base = root.joinpath(*module.split("."))
    candidates = (base / "__init__.py", base.with_name(f"{base.name}.py"))
    return next((path for path in candidates if path.is_file()), None)


def _parents(module: str) -> list[str]:
    parts = module.split(".")
    return [".".join(parts[:depth]) for depth in range(1, len(parts))]


@cache
def _imported(path: Path, module: str, root: Path) -> tuple[str, ...]:
    """Lists names that a file imports and that may be modules.

    `from a import b` gives a, a.b, and c where the stub of a lazy package says that b is of c.
    """
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    found = []
    for base, name in _names(path, package):
        found.append(base)
        if name:
            found += [f"{base}.{name}", *_defined_in(base, name, root)]
    return tuple(found)


def _names(path: Path, package: str) -> Iterator[tuple[str, str]]:
    """Walks over the import statements of a file: what is imported from, and the name if any."""
    for node in ast.walk(ast.parse(path.read_bytes(), filename=str(path))):
        if isinstance(node, ast.Import):
            yield from ((alias.name.removeprefix(PREFIX), "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".")
            above = parts[: len(parts) + 1 - node.level] if node.level else []
            base = ".".join([*above, *filter(None, [node.module])]).removeprefix(PREFIX)
            yield from ((base, alias.name) for alias in node.names)


def _defined_in(package: str, name: str, root: Path) -> list[str]:
    """Names the module that the stub of a lazy package takes a name from."""
    if package.partition(".")[0] not in PACKAGES:
        return []
    return [
        base for base, known in _stub(root.joinpath(*package.split(".")), package) if known == name
    ]


@cache
def _stub(folder: Path, package: str) -> tuple[tuple[str, str], ...]:
    stub = folder / "__init__.pyi"
    return tuple(_names(stub, package)) if stub.is_file() else ()


def _resources(folder: Path) -> Iterator[Path]:
    """Finds the resources in a package's folder and in its subfolders that are no packages."""
    for path in sorted(folder.iterdir()):
        if path.is_dir() and not (path / "__init__.py").exists():
            yield from _resources(path)
        elif path.suffix in RESOURCES:
            yield path
