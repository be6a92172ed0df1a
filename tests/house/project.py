"""Reads the project's own source: its modules, what they import, and what they define."""

import ast
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from pipeline.runtime import ROOT

PACKAGES = ("sim", "pipeline", "reports", "benchmarks")
Import = tuple[ast.ImportFrom | ast.Import, str]


@dataclass(frozen=True)
class Module:
    """One file of the project."""

    path: Path

    @property
    def name(self) -> str:
        parts = self.path.relative_to(ROOT).with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)

    @property
    def folder(self) -> str:
        return ".".join(self.path.parent.relative_to(ROOT).parts)

    @property
    def is_face(self) -> bool:
        return self.path.name == "__init__.py"

    @property
    def lines(self) -> int:
        return len(self.path.read_text().splitlines())

    @property
    def tree(self) -> ast.Module:
        return _parsed(self.path)

    def imports(self) -> tuple[Import, ...]:
        """Every import of the project: the statement, and each module or face it names."""
        return _imports(self.path)

    def imported_modules(self) -> frozenset[str]:
        """The modules of the project that are imported, through faces to where a name is from."""
        return _imported_modules(self.path)


@cache
def _imports(path: Path) -> tuple[Import, ...]:
    found: list[Import] = []
    for node in ast.walk(_parsed(path)):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        found += ((node, name) for name in names if name.split(".")[0] in PACKAGES)
    return tuple(found)


@cache
def _imported_modules(path: Path) -> frozenset[str]:
    found: set[str] = set()
    for node, base in _imports(path):
        names = [alias.name for alias in node.names] if isinstance(node, ast.ImportFrom) else []
        found |= {base} | {source for name in names for source in resolved(base, name)}
    return module_names() & found


@cache
def _parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_bytes())


def forget() -> None:
    """Drops the parsed trees: 100 MB, in a process that runs other tests after these."""
    for known in (_parsed, _imports, _imported_modules, resolved):
        known.cache_clear()


@cache
def modules(*packages: str) -> tuple[Module, ...]:
    """The modules of some packages, or of all, in the order of their paths."""
    return tuple(
        Module(path)
        for package in packages or PACKAGES
        for path in sorted((ROOT / package).rglob("*.py"))
    )


@cache
def module_names() -> frozenset[str]:
    return frozenset(module.name for module in modules() if not module.is_face)


@cache
def resolved(base: str, name: str) -> tuple[str, ...]:
    """The modules that `from base import name` may lead to."""
    stub = ROOT.joinpath(*base.split("."), "__init__.pyi")
    sources = [f"{base}.{name}"]
    if stub.is_file():
        for node in _parsed(stub).body:
            if isinstance(node, ast.ImportFrom) and any(a.name == name for a in node.names):
                sources += [f"{base}.{node.module}"] if node.module else []
    return tuple(sources)
