"""Checks what is written about a package: assembly sheet and manifest."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from pipeline.datasets import file_hash
from pipeline.fabrication.checks.package_record import PackageRecord
from pipeline.fabrication.papers import manifest
from pipeline.fabrication.readback import BUG, Fault, read_pages


def letters(folder: Path) -> dict[str, str]:
    """What the manifest says that small units carry instead of their ids, by label."""
    return dict(manifest.read(folder)["letters_for_ids"])


def check(record: PackageRecord) -> Iterator[Fault]:
    """Faults of a package's papers."""
    yield from _unique(record)
    names = {label: f"{label}={letter}" for label, letter in record.letters.items()}
    shown = [names.get(label, label) for label in record.wanted.polygons]
    yield from read_pages.check(record.folder / "assembly.pdf", shown)
    yield from _manifest(record.folder)


def _unique(record: PackageRecord) -> Iterator[Fault]:
    """No two units carry the same id or letter."""
    carried = Counter(record.letters.get(label, label) for label in record.wanted.polygons)
    for words, count in carried.items():
        if count > 1:
            where = record.folder / manifest.NAME
            yield Fault(f"unit {words}", f"{count} units carry this", "labels", BUG, where)


def _manifest(folder: Path) -> Iterator[Fault]:
    """The hashes of all files, and of no others."""
    path = folder / manifest.NAME
    told = manifest.read(folder)
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
