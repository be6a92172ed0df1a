"""The design that changes nothing, to feed stages that want one."""

from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import datasets, posing, problem
from pipeline.datasets import provenance
from pipeline.datasets.tables import TABLES
from pipeline.posing.to_scene import altered_lattice_of


def write(path: Path) -> Path:
    """Writes design.nc beside a problem file."""
    asked = problem.load(path)
    intact, altered = posing.lattice_of(asked), altered_lattice_of(asked)
    vertices = posing.spread(altered.padded(altered.vertices), altered, intact.n_units)
    labels = {
        "case": len(posing.case_directions(asked)),
        "method": 1,
        "evaluation": 1,
        "variable": 1,
        "constraint": 0,
    }
    plain = {
        name: (variable.dims, np.zeros([labels[dim] for dim in variable.dims], variable.dtype))
        for name, variable in TABLES["design"].items()
        if set(variable.dims) <= labels.keys() and not variable.coordinate
    }
    design = xr.Dataset(
        plain
        | posing.network_variables(asked, posing.scene_of(asked, path.parent))
        | {
            "vertices": (("unit", "vertex", "xy"), vertices),
            "vertices_initial": (("unit", "vertex", "xy"), intact.padded(intact.vertices)),
            "end_angles": (("ligament", "end"), np.full((intact.n_ligaments, 2), np.nan)),
            "centroid": (("unit", "xy"), vertices.mean(axis=1)),
        },
        posing.unit_coordinates(intact)
        | {
            "direction": ("case", np.rad2deg(posing.case_directions(asked))),
            "method": ["sqp"],
            "evaluation": [0],
            "constraint": np.zeros(0, "U1"),
            "constraint_units": ("constraint", np.zeros(0, "U1")),
        },
        {"shipped_method": "sqp"},
    )
    out = path.with_name("design.nc")
    datasets.write(design, out, "design", provenance.of_study(asked, "design"))
    return out
