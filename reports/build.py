"""Builds the report of Figure 2: PDF, SVG, PNG, page, facts and tables.

The files are made in a folder beside the wanted one and moved in one by one when all of them are
whole, so that a reader never meets half a report. The same datasets give the same bytes.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import xarray as xr

from reports import facts as fact_files
from reports import page, scene, style
from reports.fig2 import content, figure, tables
from reports.fig2 import facts as fig2_facts


def write_report(datasets: Mapping[str, xr.Dataset], folder: Path) -> list[Path]:
    """Write all files of the report into an existing `folder`; returns their paths."""
    design, response, sweep = (datasets[name] for name in ("design", "response", "sweep"))
    described = scene.of(design)
    draft = scene.draft_reasons(described, response, sweep)
    with style.styled():
        drawing = figure.build(described, design, response, sweep, draft=bool(draft))
        paths = style.save(drawing, folder / "fig2")
    facts = fig2_facts.collect(described, design, response, sweep)
    fact_files.write_json(facts, folder / "facts.json")
    fact_files.write_csv(facts, folder / "facts.csv")
    data_tables = tables.build(described, design, response, sweep)
    for table in data_tables:
        (folder / table.name).write_bytes(table.csv)
    svg = (folder / "fig2.svg").read_text(encoding="utf-8")
    html = page.render(content.build(described, datasets, facts, data_tables, svg, draft))
    (folder / "index.html").write_text(html, encoding="utf-8")
    names = ["facts.json", "facts.csv", *(table.name for table in data_tables), "index.html"]
    return [*paths, *(folder / name for name in names)]


def publish(datasets: Mapping[str, xr.Dataset], folder: Path) -> list[Path]:
    """Write the report aside and move its files into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    try:
        for path in write_report(datasets, aside):
            with path.open("rb") as file:
                os.fsync(file.fileno())
            path.replace(folder / path.name)
    finally:
        shutil.rmtree(aside)
    return sorted(folder.iterdir())


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; see --help."""
    parser = argparse.ArgumentParser(prog="python -m reports.build", description=__doc__)
    parser.add_argument("--problem", type=Path, required=True, help="the study's problem.yaml")
    for name in ("design", "response", "sweep"):
        parser.add_argument(f"--{name}", type=Path, required=True, help=f"{name}.nc")
    parser.add_argument("--out-dir", type=Path, required=True, help="folder of the report")
    given = parser.parse_args(arguments)
    datasets = {}
    for name in ("design", "response", "sweep"):
        with xr.open_dataset(getattr(given, name)) as opened:
            datasets[name] = opened.load()
    for path in publish(datasets, given.out_dir):
        sys.stdout.write(f"{path}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
