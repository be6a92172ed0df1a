"""Lists the calibrations and the files that each depends on.

A calibration is a file experiments/calibration/NAME.yaml. It names measured files beside it, or
tells how they are computed.
"""

from __future__ import annotations

from pathlib import Path

from snakemake.iocontainers import Wildcards

from pipeline.calibration import inputs
from pipeline.problem.fields import named_files
from pipeline.problem.reading import load_section
from pipeline.runtime import WORK, UserError

_FOLDER = "experiments/calibration"


def calibrations(root: Path = WORK) -> list[str]:
    """Lists the names of all calibrations."""
    return sorted(path.stem for path in (root / _FOLDER).glob("*.yaml"))


def measurements(wildcards: Wildcards) -> dict[str, str]:
    """Lists the files that a fit depends on: YAML, measured files, problems, or computed ones."""
    source = f"{_FOLDER}/{wildcards.calibration}.yaml"
    asked = _described(source)
    if asked is not None and asked.virtual is not None:
        folder = f"results/calibration/{wildcards.calibration}/data"
        return {"folder": folder, **named_by(wildcards)}
    return {"description": source, **named_by(wildcards)}


def named_by(wildcards: Wildcards) -> dict[str, str]:
    """Lists the files that a calibration names, and those that the problems of its tracks name."""
    asked = _described(f"{_FOLDER}/{wildcards.calibration}.yaml")
    if asked is None:
        return {}
    try:
        found = inputs.source_files(asked, Path(_FOLDER))
    except UserError:  # of a problem, of which the stage will tell
        found = named_files(asked, Path(_FOLDER))
    return {key.replace(".", "_"): file.as_posix() for key, file in found.items()}


def description(wildcards: Wildcards) -> str:
    """Names the YAML that a fit takes."""
    found = measurements(wildcards)
    return found.get("description") or f"{found['folder']}/calibration.yaml"


def measured_files(folder: str, pattern: str = "*.csv", root: Path = WORK) -> list[str]:
    """Lists the measured files of a validation, all of which its YAML may name."""
    found = (root / "experiments/validation" / folder).glob(pattern)
    return sorted(path.relative_to(root).as_posix() for path in found)


def _described(source: str) -> inputs.Calibration | None:
    """Reads the calibration; None where it cannot be read, of which the stage will tell why."""
    try:
        return load_section(WORK / source, inputs.Calibration)
    except UserError:
        return None
