"""Which source files decide what a stage does, found through its import statements.

Snakemake does not see an edit in an imported module; a hash of these files among a rule's params
makes it see.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from pipeline.environment import ROOT

PACKAGES = ("sim", "pipeline", "reports", "benchmarks")
RESOURCES = {".css", ".csv", ".html", ".j2", ".js", ".json", ".mplstyle", ".svg", ".yaml"}


@cache
def source_hash(module: str, root: Path = ROOT) -> str:
    """Hash of the source of a module and of everything of this project that it imports."""
    digest = hashlib.sha256()
    for path in source_files(module, root):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(root).as_posix()} {len(content)}\n".encode() + content)
    return digest.hexdigest()[:16]


@cache
def source_files(module: str, root: Path = ROOT) -> tuple[Path, ...]:
    """Files whose content decides what `python -m module` does, sorted.

    These are the modules reached by import statements, at any depth and inside functions too, the
    packages that hold them, and the resources (templates, styles) in the folders of those packages.

    Raises:
        ModuleNotFoundError: there is no such module below `root`.
    """
    if _locate(module, root) is None:
        raise ModuleNotFoundError(f"no module {module!r} below {root}", name=module)
    modules: dict[str, Path] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        path = _locate(name, root)
        if name in modules or path is None:
            continue
        modules[name] = path
        waiting += _parents(name)
        waiting += _imported(path, name)
    packages = {path.parent for path in modules.values() if path.name == "__init__.py"}
    resources = (file for package in packages for file in _resources(package))
    return tuple(sorted({*modules.values(), *resources}))


@cache
def _locate(module: str, root: Path) -> Path | None:
    """File of a module of this project; None for what lies outside or is no module."""
    if module.partition(".")[0] not in PACKAGES:
        return None
    base = root.joinpath(*module.split("."))
    candidates = (base / "__init__.py", base.with_name(f"{base.name}.py"))
    return next((path for path in candidates if path.is_file()), None)


def _parents(module: str) -> list[str]:
    parts = module.split(".")
    return [".".join(parts[:depth]) for depth in range(1, len(parts))]


@cache
def _imported(path: Path, module: str) -> tuple[str, ...]:
    """Names that a file imports and that may be modules: `from a import b` gives a and a.b."""
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    nodes = ast.walk(ast.parse(path.read_bytes(), filename=str(path)))
    return tuple(name for node in nodes for name in _names(node, package))


def _names(node: ast.AST, package: str) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        above = package.split(".")[: len(package.split(".")) + 1 - node.level] if node.level else []
        base = ".".join([*above, *filter(None, [node.module])])
        yield base
        yield from (f"{base}.{alias.name}" for alias in node.names)


def _resources(folder: Path) -> Iterator[Path]:
    """Resources in a package's folder and in those of its subfolders that are no packages."""
    for path in sorted(folder.iterdir()):
        if path.is_dir() and not (path / "__init__.py").exists():
            yield from _resources(path)
        elif path.suffix in RESOURCES:
            yield path
