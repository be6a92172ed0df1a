"""Writes and reads the manifest of a package: its sources, its parameters, its files."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.datasets import file_hash, git_commit, package_versions
from pipeline.fabrication.parts import BuiltSpecimen, Ligament
from pipeline.problem import Problem, section_hash
from pipeline.runtime import UserError

MANIFEST = "manifest.json"
_AGAIN = "make the package again: python -m pipeline run STUDY_fabrication --forcerun fabricate"
_READ = (
    "units",
    "letters_for_ids",
    "shims",
    "laser_route",
    "prebend",
    "drives",
    "free_dofs",
    "stiffness_factors",
    "as_built",
    "thin_walls_mm",
    "files",
)


PREBEND_NOTE = (
    "each shim before any load, by the number of its ligament: units that it joins; middle of the"
    " ligament; angles of its slots against it, counter-clockwise; largest strain and largest"
    " moment, of a strip that slides in clamps where the walls of its slots begin; its free length"
    " between these"
)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Reads the manifest of a package.

    Raises:
        UserError: there is none, or it is that of another version of the exporter.
    """
    path = folder / MANIFEST
    try:
        content = dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        what = f"the manifest cannot be read: {error}"
        raise UserError(what, file=path, remedy=_AGAIN) from error
    if missing := [key for key in _READ if key not in content]:
        what = "another version of the exporter made the package: its manifest lacks a key"
        raise UserError(what, file=path, key=missing[0], remedy=_AGAIN)
    return content


def write_manifest(
    folder: Path,
    specimen: BuiltSpecimen,
    problem: Problem,
    design: Path,
    as_built: Mapping[str, float | str] | None = None,
) -> None:
    """Writes the manifest of all other files in a package's folder.

    Args:
        folder: the package, complete but for its manifest.
        specimen: what is built.
        problem: the problem whose section `fabrication` holds.
        design: the design dataset.
        as_built: what the simulation makes of the shims as drawn, if it was asked.
    """
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path.name != MANIFEST)
    content = {
        "study": specimen.study,
        "structure": specimen.structure,
        "design_sha256": file_hash(design),
        "problem_hash": section_hash(problem, "fabricate"),
        "parameters": problem.fabrication.model_dump(mode="json"),
        "parameters_note": "lengths in mm; spares is a share",
        "units": [unit.label for unit in specimen.units],
        "letters_for_ids": specimen.letters,
        "shims": {shim.id: shim.count for shim in specimen.shims},
        "laser_route": problem.fabrication.laser_route,
        "prebend": {str(one.number): _prebend(one) for one in specimen.ligaments},
        "prebend_note": PREBEND_NOTE,
        "drives": [list(group) for group in specimen.drive_groups],
        "drives_note": "units that the same drives move; no part of the fixture joins others",
        "free_dofs": {label: list(dofs) for label, dofs in specimen.free_dofs.items()},
        "free_dofs_note": "of clamped and driven units in the study; the fixtures hold them all",
        "stiffness_factors": {
            str(number): [float(f"{factor:.5g}") for factor in factors]
            for number, factors in specimen.stiffness.items()
        },
        "stiffness_factors_note": "axial, shear and bending stiffness of ligaments in the study"
        " over those of the shims that are drawn, by their numbers, where they are others",
        "as_built": as_built,
        "thin_walls_mm": {label: round(wall, 3) for label, wall in specimen.thin.items()},
        "packages": dict(package_versions()),
        "git_commit": git_commit(),
        "files": {path.relative_to(folder).as_posix(): file_hash(path) for path in files},
    }
    text = json.dumps(content, indent=1, sort_keys=True, ensure_ascii=False, allow_nan=False)
    (folder / MANIFEST).write_text(text + "\n", encoding="utf-8", newline="\n")


def _prebend(ligament: Ligament) -> dict[str, str | float | list[float]]:
    return {
        "units": ligament.name,
        "middle_mm": [round(x, 3) for x in ligament.middle],
        "end_angles_deg": [round(math.degrees(angle), 2) for angle in ligament.angles],
        "strain": round(ligament.strain, 5),
        "moment_N_mm": round(ligament.moment, 3),
        "free_mm": round(ligament.free, 3),
    }
