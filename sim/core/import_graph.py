"""Follows import statements of this project to the files that decide what a module does."""

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

PACKAGES = ("sim", "pipeline", "reports", "benchmarks")
_INSTALLED = "metacloak."  # begins their names where they are installed as one package


def import_closure(modules: Iterable[str], root: Path) -> dict[str, Path]:
    """Maps the dotted names of modules and of all that they import, at any depth, to their files.

    Imports inside functions count. A name that is imported from a lazy package leads to the module
    that its stub names. What lies outside of the project's `root` is left out.
    """
    found: dict[str, Path] = {}
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        path = locate(name, root)
        if name in found or path is None:
            continue
        found[name] = path
        waiting += _parents(name)
        waiting += _imported(path, name, root)
    return found


@cache
def locate(module: str, root: Path) -> Path | None:
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
    for node in _statements(ast.parse(path.read_bytes(), filename=str(path))):
        if isinstance(node, ast.Import):
            yield from ((alias.name.removeprefix(_INSTALLED), "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".")
            above = parts[: len(parts) + 1 - node.level] if node.level else []
            base = ".".join([*above, *filter(None, [node.module])])
            yield from ((base.removeprefix(_INSTALLED), alias.name) for alias in node.names)


def _statements(block: ast.AST) -> Iterator[ast.AST]:
    """Walks over a block's statements at any depth; expressions, which hold no import, are left."""
    for field in ("body", "orelse", "handlers", "finalbody", "cases"):
        for statement in getattr(block, field, ()):
            yield statement
            if not isinstance(statement, ast.Expr | ast.Assign | ast.Return):
                yield from _statements(statement)


def _defined_in(package: str, name: str, root: Path) -> list[str]:
    """Names the module that the stub of a lazy package takes a name from."""
    if package.partition(".")[0] not in PACKAGES:
        return []
    folder = root.joinpath(*package.split("."))
    return [base for base, known in _stub(folder, package) if known == name]


@cache
def _stub(folder: Path, package: str) -> tuple[tuple[str, str], ...]:
    stub = folder / "__init__.pyi"
    return tuple(_names(stub, package)) if stub.is_file() else ()
