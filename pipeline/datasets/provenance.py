"""Records the origin of datasets as attributes: problem, parents, versions, commit and plan.

No dates, hosts or wall times: the same sources make the same bytes.
"""

from __future__ import annotations

import hashlib
import json
import platform
import subprocess
from collections.abc import Mapping
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from threadpoolctl import threadpool_info

from pipeline.problem import Problem, canonical_json, section_hash
from pipeline.runtime import INSTALLED, ROOT, UserError, version
from sim.core import instruction_set

if TYPE_CHECKING:
    import xarray as xr

COMMIT_FILE = "COMMIT"
"""Names the commit of sources that were published without their history."""
SYNTHETIC_LABEL = "SYNTHETIC"
"""Stands wherever data are shown that were computed or rendered, not measured or filmed."""
PACKAGES = ("daqp", "jax", "jaxlib", "netCDF4", "numpy", "scipy", "shapely", "xarray")


def of_study(
    problem: Problem,
    stage: str,
    *,
    method: str | None = None,
    parents: Mapping[str, Path] | None = None,
    plan: object = None,
) -> dict[str, str]:
    """Records the provenance of a dataset that a stage makes of a problem.

    As much of the problem as the stage (and its one optimisation method) depends on is stored in
    full. `parents` are files that it read, by role; `plan` is what was decided and skipped:
    anything that JSON can hold.
    """
    return {
        "problem": canonical_json(problem, stage, method),
        "problem_hash": section_hash(problem, stage, method),
        **_made_from(parents or {}),
        "plan": _json(plan if plan is not None else {}),
    }


def of_recording(
    description: str, parents: Mapping[str, Path], *, synthetic: bool, role: str = "recording"
) -> dict[str, str]:
    """Records the provenance of what is made of a recording or of a calibration's measurements.

    `description` is its YAML as JSON; `parents` are files that were read, by role: the hash of a
    folder is that of its files.
    """
    return {role: description, "synthetic": "yes" if synthetic else "no", **_made_from(parents)}


def _made_from(parents: Mapping[str, Path]) -> dict[str, str]:
    written_by = f"version {version()}" if INSTALLED else f"commit {git_commit()}"
    return {
        "history": f"written by metacloak, {written_by}",
        "parents": _json({name: file_hash(path) for name, path in parents.items()}),
        "packages": _json(dict(package_versions())),
        "git_commit": git_commit(),
    }


def check_parent(made: xr.Dataset, file: Path, role: str, parent: Path) -> None:
    """Refuses a dataset that was made from another file than the one beside it, its `role`.

    Raises:
        UserError: it tells of another file, or of none.
    """
    try:
        known = json.loads(made.attrs["parents"])[role]
    except (LookupError, ValueError, TypeError):
        known = None
    if known != file_hash(parent):
        remedy = f"make it again from {parent}"
        raise UserError(f"it is that of another {role}", file=file, key="parents", remedy=remedy)


def file_hash(path: Path) -> str:
    """Hashes a file's bytes, or the names and bytes of a folder's files: SHA-256, in hex."""
    if path.is_dir():
        inside = sorted(each for each in path.iterdir() if each.is_file())
        listed = "".join(f"{each.name} {file_hash(each)}\n" for each in inside)
        return hashlib.sha256(listed.encode()).hexdigest()
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@lru_cache(maxsize=1)
def package_versions() -> Mapping[str, str]:
    """Versions of Python and of the packages that results depend on, and the instructions used."""
    found = {"python": platform.python_version(), "instructions": instructions()}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "absent"
    return found


def instructions() -> str:
    """Names the level of instructions, and what is loaded of NumPy and BLAS that leaves it.

    A library keeps to the level only if it is loaded after that is asked for. Of XLA nothing can be
    seen: it reads its flag when it first compiles.
    """
    core = np._core._multiarray_umath  # type: ignore[attr-defined]
    wider = [
        each
        for each in core.__cpu_dispatch__
        if core.__cpu_features__[each] and each.startswith(("X86_V4", "AVX512"))
    ]
    blas = {row.get("architecture", "Haswell") for row in threadpool_info()} - {"Haswell"}
    found = {"NumPy": wider, "OpenBLAS": sorted(blas)}
    told = ", ".join(f"{name} {' '.join(each)}" for name, each in found.items() if each)
    if not (told and instruction_set.can_pin()):
        return instruction_set.level()
    return f"{instruction_set.LEVEL} asked for, but loaded before that: {told}"


@lru_cache(maxsize=1)
def git_commit() -> str:
    """Names the commit of the sources, or "unknown" where they are no git checkout."""
    if INSTALLED:
        return "unknown"  # a folder above site-packages may be a checkout of something else
    if (ROOT / COMMIT_FILE).is_file():
        return (ROOT / COMMIT_FILE).read_text().strip()
    return head_commit(ROOT) or "unknown"


def head_commit(root: Path) -> str:
    """Asks git for the commit of the checkout whose top is this folder; "" where it is none.

    A folder below the top may hold other sources than those of that repository.
    """
    command = ["git", "-C", str(root), "rev-parse", "--show-prefix", "HEAD"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    prefix, commit = done.stdout.splitlines()
    return "" if prefix else commit


def _json(value: object) -> str:
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)
