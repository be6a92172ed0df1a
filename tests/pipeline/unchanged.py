"""The design that changes nothing, to feed stages that want one."""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from pipeline import datasets, posing, problem
from pipeline.__main__ import run_stage
from pipeline.datasets import provenance
from pipeline.datasets.tables import Kind
from pipeline.posing.to_scene import altered_lattice_of
from pipeline.problem import Problem
from tests.pipeline.samples import filled


def design(
    asked: Problem, folder: Path, more: dict[str, Any], vertices: np.ndarray | None = None
) -> xr.Dataset:
    """A design of the regular lattice, or of other vertices (n_units, 4, 2), mm."""
    intact, altered = posing.lattice_of(asked), altered_lattice_of(asked)
    if vertices is None:
        vertices = posing.spread(altered.padded(altered.vertices), altered, intact.n_units)
    return xr.Dataset(
        posing.network_variables(asked, posing.scene_of(asked, folder))
        | {
            "vertices": (("unit", "vertex", "xy"), vertices),
            "vertices_initial": (("unit", "vertex", "xy"), intact.padded(intact.vertices)),
            "end_angles": (("ligament", "end"), np.full((intact.n_ligaments, 2), np.nan)),
            "centroid": (("unit", "xy"), vertices.mean(axis=1)),
            "smallest_gap": ((), 0.11),
            "overlaps": ((), 0),
        }
        | more,
        posing.unit_coordinates(intact)
        | {"direction": ("case", np.rad2deg(posing.case_directions(asked)))},
        {"shipped_method": "sqp"},
    )


def chunk(stage: str, kind: Kind, folder: Path, out: Path, of: tuple[int, int]) -> xr.Dataset:
    """Runs a part of a stage for a study and this design: (number, count)."""
    words = ["--problem", str(folder / "problem.yaml"), "--design", str(folder / "design.nc")]
    words += ["--chunk", str(of[0]), "--chunks", str(of[1]), "--out", str(out)]
    assert run_stage(stage, ["run", *words]) == 0
    return datasets.read(out, kind)


def joined(stage: str, kind: Kind, folder: Path, out: Path, count: int) -> bytes:
    """Runs a stage in so many parts and gathers them."""
    parts = [out.with_name(f"{kind}_{k}.nc") for k in range(count)]
    for k, part in enumerate(parts):
        chunk(stage, kind, folder, part, (k, count))
    assert run_stage(stage, ["gather", "--parts", *map(str, parts), "--out", str(out)]) == 0
    return out.read_bytes()


def write(path: Path, preset: str | None = None) -> Path:
    """Writes design.nc beside a problem file."""
    asked, one = problem.load(path, preset), dict.fromkeys(("method", "evaluation", "variable"), 1)
    sizes = one | {"case": len(posing.case_directions(asked)), "constraint": 0}
    none, out = np.zeros(0, "U1"), path.with_name("design.nc")
    made = design(asked, path.parent, filled("design", sizes)).assign_coords(
        method=["sqp"], evaluation=[0], constraint=none, constraint_units=("constraint", none)
    )
    datasets.write(made, out, "design", provenance.of_study(asked, "design"))
    return out
