"""Checks what is written about a package: assembly sheet, bill of materials, manifest."""

from __future__ import annotations

import csv
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from pipeline.errors import UserError
from pipeline.fabrication.checks import pages
from pipeline.fabrication.checks.cutting import every_unit
from pipeline.fabrication.checks.faults import Fault
from pipeline.fabrication.checks.wanted import Wanted
from pipeline.provenance import file_hash

_BUG = "run the same command again; if it stays, the exporter has a bug"


def check(folder: Path, wanted: Wanted) -> Iterator[Fault]:
    """Faults of a package's papers."""
    yield from pages.check(folder / "assembly.pdf", wanted.polygons.keys())
    yield from _bill(folder / "bom.csv", wanted)
    yield from _manifest(folder)


def rows(path: Path) -> list[dict[str, str]]:
    """The lines of the bill of materials.

    Raises:
        UserError: it cannot be read.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file, strict=True))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        what = f"the bill of materials that was just written cannot be read back: {error}"
        raise UserError(what, file=path, remedy=_BUG) from error


def _bill(path: Path, wanted: Wanted) -> Iterator[Fault]:
    """Each unit once, and shims for each ligament and some to spare."""
    listed = rows(path)
    units: Counter[str] = Counter()
    for row in listed:
        if row["item"] == "unit":
            units[row["id"]] += int(row["count"])
    yield from every_unit(units, wanted, path)
    shims = sum(int(row["count"]) for row in listed if row["item"] == "shim")
    if shims <= wanted.ligaments:
        what = f"{shims} shims for {wanted.ligaments} ligaments, and none to spare"
        yield Fault("the bill of materials", what, "shims.spares", _BUG, path)


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
        yield Fault("the manifest", f"{name} is not in it, or not there", "laser", _BUG, path)
    for name in sorted(files.keys() & told["files"].keys()):
        if files[name] != told["files"][name]:
            yield Fault("the manifest", f"{name} is another file than listed", "laser", _BUG, path)
