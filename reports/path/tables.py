"""Data tables of the path: what its curves show, as plain CSV."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from reports.fig2.tables import history, vertices
from reports.path import measures, scatter
from reports.path.course import course, structures
from reports.path.curves import over_cases
from reports.study import Study
from reports.tables import Table

Columns = dict[str, NDArray[Any]]


def build(study: Study) -> list[Table]:
    """All tables, in the order of the panels."""
    tables = [
        Table(
            "design.csv",
            "vertices of the cloaked and of the initial design",
            vertices(study.design),
        ),
        Table("loss_history.csv", "loss against evaluation (panel b)", history(study.design)),
        Table("path.csv", "every structure along the path", path(study)),
    ]
    if study.scatter is not None:
        tables.append(
            Table("robustness.csv", "imperfect copies, one a line", copies(study, study.scatter))
        )
    return tables


def path(study: Study) -> Columns:
    """One row a sample: the measure, contraction, reaction, energies, voids of each structure."""
    problem, response = study.problem, study.response
    way = course(problem, response)
    measure = measures.measure_of(problem)
    columns: Columns = {"time_s": response["time"].values}
    if way.static:
        columns["displacement_mm"] = way.values
    series = {
        f"{measure.key}_{'1' if measure.unit == '1' else measure.unit}": measure.of(response),
        "contraction_mm": measures.contraction(problem, response),
        "reaction_N": measures.reaction(response),
        "strain_energy_Nmm": response["strain_energy"],
        "contact_energy_Nmm": response["contact_energy"],
        "min_void_angle_rad": response["min_void_angle"],
    }
    for label, values in series.items():
        mean = over_cases(problem, values)
        for name in structures(response):
            columns[f"{name}_{label}"] = mean.sel(structure=name).values
    return columns


def copies(study: Study, made: xr.Dataset) -> Columns:
    """One row a copy."""
    measure = measures.measure_of(study.problem)
    values = scatter.curves(study.problem, measure, study.response, made).isel(time=-1)
    noise, sample = np.meshgrid(made["noise"].values, made["sample"].values, indexing="ij")
    columns: Columns = {
        "noise": noise.ravel(),
        "sample": sample.ravel(),
        f"{measure.key}_{'1' if measure.unit == '1' else measure.unit}": values.values.ravel(),
        "reaction_N": made["reaction"].isel(time=-1).values.ravel(),
    }
    for name in ("loss", "min_void_angle", "clashes", "redrawn", "status"):
        columns[name] = made[name].values.ravel()
    return columns
