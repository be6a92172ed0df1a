"""A written package that is being checked, and what it has to hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from pipeline.fabrication.checks import sheet_checks
from pipeline.fabrication.checks.assembled_specimen import Shapes
from pipeline.fabrication.checks.expected_parts import Wanted
from pipeline.fabrication.engraving import Reading
from pipeline.fabrication.readback import Drawing, read_drawings
from pipeline.problem.sections import Fabrication


@dataclass(frozen=True)
class PackageRecord:
    """A package's folder beside what is wanted of it.

    Attributes:
        folder: that is checked.
        wanted: units and ligaments that have to be there.
        found: outlines of the units in the assembled specimen.
        asked: the parameters of fabrication.
        letters: what small units carry instead of their ids, by id.
    """

    folder: Path
    wanted: Wanted
    found: Shapes
    asked: Fabrication
    letters: Mapping[str, str]

    @cached_property
    def drawings(self) -> dict[tuple[str, str], list[Drawing]]:
        """The sheets by kind and variant, as R2010."""
        read: dict[tuple[str, str], list[Drawing]] = {}
        for path in sorted((self.folder / "laser").glob("*.dxf")):
            if not path.stem.endswith("_r12"):
                kind, _, variant = path.stem.split("_")
                read.setdefault((kind, variant), []).append(read_drawings.read(path))
        return read

    @cached_property
    def engraved(self) -> dict[str, Reading]:
        """How the ids of units stand that can be read on the sheets, by id."""
        read: dict[str, Reading] = {}
        for drawing in self.drawings.get(("units", sheet_checks.NOMINAL), []):
            read |= sheet_checks.ids(drawing, self.letters)
        return read
