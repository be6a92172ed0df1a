"""Reports as files: JSON with every run, CSV with a row a candidate; and what was stored before."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import platform
import subprocess
from collections.abc import Mapping
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from benchmarks.harness.records import BenchmarkReport, CandidateResult
from benchmarks.harness.text_table import error_columns
from pipeline.datasets import git_commit, package_versions

SCHEMA_VERSION = 1
ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("sim", "benchmarks", "pipeline", "experiments")


def machine(core: int | None = None) -> dict[str, Any]:
    """Where and when this is measured, from which sources; the core if it is bound to one."""
    return {
        "processor": _processor(),
        "core": core,
        "cores": os.cpu_count(),
        "load_average": os.getloadavg()[0],
        "system": platform.platform(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": git_commit(),
        "changed_since_commit": _changed(),
        "packages": dict(package_versions()),
    }


def _changed() -> list[str]:
    """Source files that are not as the commit has them; empty outside a git checkout."""
    command = ["git", "-C", str(ROOT), "status", "--porcelain", "--", *SOURCES]
    done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    return [line[3:] for line in done.stdout.splitlines()]


def _processor() -> str:
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.machine()


def write(report: BenchmarkReport, folder: Path) -> tuple[Path, Path]:
    """Writes ``<name>.json`` and ``<name>.csv``, and returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    stem = folder / report.benchmark.name
    paths = stem.with_suffix(".json"), stem.with_suffix(".csv")
    record = json.dumps(_without_nan(_record(report)), indent=1, allow_nan=False)
    for path, content in zip(paths, (record + "\n", _rows(report)), strict=True):
        aside = path.with_suffix(path.suffix + ".tmp")
        aside.write_text(content, encoding="utf-8")
        aside.replace(path)
    return paths


def _record(report: BenchmarkReport) -> dict[str, Any]:
    return {
        "schema_version": SCHEMA_VERSION,
        "benchmark": report.benchmark.name,
        "title": report.benchmark.title,
        "machine": dict(report.machine),
        "outcomes": [asdict(outcome) for outcome in report.outcomes],
        "targets": [
            {
                "name": target.name,
                "unit": target.unit,
                "value": value,
                "at_most": target.at_most,
                "at_least": target.at_least,
                "aim": target.aim,
                "verdict": verdict,
            }
            for target, value, verdict in report.verdicts
        ],
    }


def _without_nan(node: Any) -> Any:  # noqa: ANN401  (any JSON)
    if isinstance(node, float) and not math.isfinite(node):
        return None
    if isinstance(node, Mapping):
        return {key: _without_nan(value) for key, value in node.items()}
    if isinstance(node, list | tuple):
        return [_without_nan(value) for value in node]
    return node


def _rows(report: BenchmarkReport) -> str:
    kinds = error_columns(report.outcomes)
    work = list(dict.fromkeys(what for one in report.outcomes for what in one.work))
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    figures = ["candidate", "time (s)", "spread (relative)", "runs", "compile (s)"]
    misses = [f"{kind} error (relative)" for kind in kinds]
    rows.writerow([*figures, *misses, "peak memory (MiB)", *work, "stored", "failure"])
    for one in report.outcomes:
        times = (one.seconds, one.spread, len(one.cpu_s), one.compile_s)
        errors = (one.error(kind) for kind in kinds)
        counts = (one.work.get(what, "") for what in work)
        rows.writerow([one.name, *times, *errors, one.peak_mib, *counts, one.stored, one.failure])
    return out.getvalue()


def stored_outcomes(name: str, folder: Path) -> dict[str, CandidateResult]:
    """Figures of a benchmark that were stored before, by candidate, each marked with its origin."""
    path = folder / f"{name}.json"
    if not path.exists():
        return {}
    record = json.loads(path.read_text(encoding="utf-8"))
    if record["schema_version"] != SCHEMA_VERSION:
        return {}
    made = record["machine"]
    origin = f"{made['date']}, {made['processor']}, commit {made['commit'][:10]}"
    return {
        entry["name"]: _outcome(entry, origin)
        for entry in record["outcomes"]
        if not entry["failure"]
    }


def _outcome(entry: dict[str, Any], origin: str) -> CandidateResult:
    made: dict[str, Any] = {
        key: float("nan") if value is None else value for key, value in entry.items()
    }
    made |= {key: tuple(made[key]) for key in ("cpu_s", "wall_s")}
    outcome = CandidateResult(**made)
    return outcome if outcome.stored else replace(outcome, stored=origin)
