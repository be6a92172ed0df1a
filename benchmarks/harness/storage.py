"""Writes measurements as datasets with machine, notes and targets, and reads baselines again."""

import json
import math
import os
import platform
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from benchmarks.harness.records import Measurement, Suite, quantities
from pipeline import datasets
from pipeline.datasets import git_commit, package_versions, provenance
from pipeline.runtime import ROOT
from sim.core import Floats

MEASURED = "measured"
SOURCES = ("sim", "benchmarks", "pipeline", "experiments")


def machine(core: int | None = None) -> dict[str, Any]:
    """Records where and when this is measured, from which sources; the core if bound to one."""
    return {
        "processor": _processor(),
        "core": core,
        "cores": os.cpu_count(),
        "load_average": os.getloadavg()[0],
        "system": platform.platform(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": git_commit(),
        "changed_since_commit": _changed_sources(),
        "packages": dict(package_versions()),
    }


def _changed_sources() -> list[str]:
    """Lists source files that are not as the commit has them; empty outside a git checkout."""
    command = ["git", "-C", str(ROOT), "status", "--porcelain", "--", *SOURCES]
    done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    return [line[3:] for line in done.stdout.splitlines()]


def _processor() -> str:
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.machine()


def write(
    suite: Suite,
    measured: list[Measurement] | xr.Dataset,
    about: Mapping[str, Any],
    limits: Mapping[str, float],
    folder: Path,
) -> Path:
    """Writes ``<suite>.nc``, and returns its path; targets and notes are JSON in attributes."""
    told: dict[str, str] = {"subject": suite.subject, "reference": suite.reference}
    told["machine"] = json.dumps(dict(about), sort_keys=True)
    if not isinstance(measured, xr.Dataset):
        notes = {one.name: one.note for one in measured if one.note}
        targets = [
            {key: getattr(target, key) for key in ("name", "unit", "at_most", "at_least", "aim")}
            | {"value": value if math.isfinite(value) else None, "verdict": verdict}
            for target, value, verdict in suite.verdicts(measured)
        ]
        lists = {"notes": notes, "targets": targets}
        told |= {key: json.dumps(found) for key, found in lists.items() if found}
        measured = dataset(measured)
    path = folder / f"{suite.name}.nc"
    rules = json.dumps({"suite": suite.name, **limits}, sort_keys=True)
    origin = provenance.of_recording(rules, {}, synthetic=False, role="rules")
    folder.mkdir(parents=True, exist_ok=True)
    datasets.write(measured.assign_attrs(told), path, suite.kind, origin)
    return path


def dataset(points: Sequence[Measurement]) -> xr.Dataset:
    """Converts measurements to a dataset ``benchmark``, without its attributes."""
    columns = quantities(list(points))
    work = list(dict.fromkeys(name for one in points for name in one.work))
    labels = {key: ("point", [getattr(one, key) for one in points]) for key in _LABELS}
    misses = [{name: one.error(name) for name in columns} for one in points]
    return xr.Dataset(
        {
            "own": ("point", np.array([one.own for one in points], dtype=np.int8)),
            "cpu_time": (("point", "run"), padded([one.cpu_s for one in points])),
            "wall_time": (("point", "run"), padded([one.wall_s for one in points])),
            "compile_time": ("point", np.array([one.compile_s for one in points])),
            "memory": ("point", np.array([one.peak_mib * 2**20 for one in points])),
            "error": (("point", "quantity"), _by_name(misses, columns)),
            "count": (("point", "work"), _by_name([one.work for one in points], work)),
            "outcome": ("point", [one.failure or MEASURED for one in points]),
        },
        {"quantity": columns, "work": work, **labels},
    )


_LABELS = ("method", "setting", "task", "units")


def stored_measurements(path: Path, names: Sequence[str]) -> dict[str, Measurement]:
    """Reads some methods' figures of an earlier run, each marked with its origin in its note."""
    if not path.exists():
        return {}
    data = datasets.read(path, "benchmark")
    about, notes = (json.loads(data.attrs.get(key, "{}")) for key in ("machine", "notes"))
    commit = about["commit"][:10]
    origin = f"NOT measured now, figures of {about['date']}, {about['processor']}, commit {commit}"
    found: dict[str, Measurement] = {}
    for k in np.flatnonzero(data["outcome"].values == MEASURED):
        point = data.isel(point=k)
        method, setting, task = (point[key].item() for key in _LABELS[:3])
        one = Measurement(method, setting, task, bool(point["own"]))
        if one.name in names:
            note = notes.get(one.name, "")
            found[one.name] = replace(
                one,
                note=note if "NOT measured" in note else "; ".join(filter(None, (note, origin))),
                units=int(point["units"]),
                compile_s=float(point["compile_time"]),
                cpu_s=_known_runs(point["cpu_time"]),
                wall_s=_known_runs(point["wall_time"]),
                errors=_name_values(point["error"]),
                work={name: int(count) for name, count in _name_values(point["count"]).items()},
                peak_mib=float(point["memory"]) / 2**20,
            )
    return found


def _known_runs(runs: xr.DataArray) -> tuple[float, ...]:
    return tuple(runs.values[np.isfinite(runs.values)].tolist())


def _name_values(values: xr.DataArray) -> dict[str, float]:
    (dim,) = values.dims
    pairs = zip(values[dim].values, values.values, strict=True)
    return {str(name): float(value) for name, value in pairs if np.isfinite(value)}


def padded(rows: Sequence[Sequence[float] | Floats]) -> Floats:
    """Stacks rows as (n_rows, longest row), NaN where a row is shorter."""
    filled = np.full((len(rows), max(1, *map(len, rows))), np.nan)
    for line, row in zip(filled, rows, strict=True):
        line[: len(row)] = row
    return filled


def _by_name(rows: Sequence[Mapping[str, float]], names: Sequence[str]) -> Floats:
    return np.array([[row.get(name, np.nan) for name in names] for row in rows]).reshape(
        len(rows), len(names)
    )
