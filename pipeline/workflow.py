"""What the Snakefile asks before anything runs: which studies there are, and what each stage depends on.

A stage depends on the sections of its problem file and on the source of every module it imports.
Both enter the workflow as hashes, so that a rerun follows from what a file says, never from its date.
Nothing heavy is imported here: this is the time one waits for "nothing to be done".
"""

from __future__ import annotations

import ast
import hashlib
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import yaml

from pipeline.environment import ROOT

PACKAGES = ("sim", "pipeline", "reports")
RESOURCES = {".css", ".csv", ".html", ".j2", ".js", ".json", ".mplstyle", ".svg", ".yaml"}
RUN_MARK = "METACLOAK_RUN"  # names the repository in the environment of every job


@dataclass(frozen=True, order=True)
class Study:
    """One study, with one preset of its problem file or with none ("")."""

    name: str
    preset: str = ""

    @classmethod
    def parse(cls, text: str) -> Study:
        """Reads "fig2" or "fig2@edge3"."""
        name, _, preset = text.partition("@")
        return cls(name, preset)

    def __str__(self) -> str:
        return f"{self.name}@{self.preset}" if self.preset else self.name

    @property
    def targets(self) -> tuple[str, ...]:
        """Names under which a command line may ask for the study."""
        return (str(self), f"{self.name}_{self.preset}") if self.preset else (self.name,)

    @property
    def problem(self) -> str:
        """Path of the problem file, from the root of the repository."""
        return f"experiments/{self.name}/problem.yaml"

    @property
    def options(self) -> str:
        """Options by which a stage finds the problem."""
        return f"--problem {self.problem}" + (f" --preset {self.preset}" if self.preset else "")


def studies(root: Path = ROOT) -> list[Study]:
    """Every study below experiments/, each followed by its presets.

    A file that is no YAML counts as a study without presets: the stage that reads it tells why.
    """
    found = []
    for path in sorted(root.glob("experiments/*/problem.yaml")):
        try:
            content = yaml.load(path.read_bytes(), Loader=yaml.CSafeLoader)
        except yaml.YAMLError:
            content = None
        presets = content.get("presets") if isinstance(content, dict) else None
        found.append(Study(path.parent.name))
        found += [Study(path.parent.name, str(preset)) for preset in presets or ()]
    return found


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


def prepare_jobs() -> None:
    """Makes the jobs of this workflow run with this Python, and marks them as ours."""
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    os.environ[RUN_MARK] = str(ROOT)
