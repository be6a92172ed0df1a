"""Checks what is written about a package: assembly sheet and manifest."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from pipeline.fabrication.checks import pages
from pipeline.fabrication.checks.faults import BUG, Fault
from pipeline.fabrication.checks.wanted import Wanted
from pipeline.provenance import file_hash


def check(folder: Path, wanted: Wanted) -> Iterator[Fault]:
    """Faults of a package's papers."""
    yield from pages.check(folder / "assembly.pdf", wanted.polygons.keys())
    yield from _manifest(folder)


def _manifest(folder: Path) -> Iterator[Fault]:
    """The hashes of all files, and of no others."""
    path = folder / "manifest.json"
    told = json.loads(path.read_text(encoding="utf-8"))
    files = {
        found.relative_to(folder).as_posix(): file_hash(found)
        for found in folder.rglob("*")
        if found.is_file() and found != path
    }
    for name in sorted(files.keys() ^ told["files"].keys()):
        yield Fault("the manifest", f"{name} is not in it, or not there", "laser", BUG, path)
    for name in sorted(files.keys() & told["files"].keys()):
        if files[name] != told["files"][name]:
            yield Fault("the manifest", f"{name} is another file than listed", "laser", BUG, path)
