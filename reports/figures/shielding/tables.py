"""Data tables of Figure 2: what its curves and map show, as plain CSV."""

from __future__ import annotations

import numpy as np
import xarray as xr

from reports.base import Table
from reports.facts import Columns, history, vertices
from reports.figures.shielding.sweep_map import frequency_map
from reports.study import ReportScene, StudyResults, from_dataset, middle_of_top_edge


def shielding_tables(study: StudyResults) -> list[Table]:
    """All tables, in the order of the panels."""
    design, response, sweep = study.design, study.response, frequency_map(study.sweep)
    return [
        Table("design.csv", "vertices of the cloaked and of the initial design", vertices(design)),
        Table("loss_history.csv", "loss against evaluation (panel b)", history(design)),
        Table(
            "top_edge.csv",
            "motion of the middle unit of the top edge, every load case (panel d)",
            top_edge(study.scene, response),
        ),
        Table("robustness.csv", "loss over loading angle and frequency (panel e)", robust(sweep)),
    ]


def top_edge(scene: ReportScene, response: xr.Dataset) -> Columns:
    """One row a time: ux, uy, theta of both structures under every load."""
    unit = middle_of_top_edge(from_dataset(response.isel(structure=0), scene.spacing))
    series = response["displacement"].isel(unit=unit)
    columns = {"time_s": response["time"].values}
    for name in response["structure"].values:
        for case, angle in enumerate(response["direction"].values):
            for dof, unit_name in (("ux", "mm"), ("uy", "mm"), ("theta", "rad")):
                values = series.sel(structure=name, dof=dof).isel(case=case).values
                columns[f"{name}_{angle:g}deg_{dof}_{unit_name}"] = values
    return columns


def robust(sweep: xr.Dataset) -> Columns:
    """One row a point of the map."""
    angle, rate = np.meshgrid(sweep["direction"], sweep["frequency"], indexing="ij")
    columns = {"direction_deg": angle.ravel(), "frequency_Hz": rate.ravel()}
    for column, name in (
        ("J_cloaked", "loss"),
        ("J_altered", "loss_altered"),
        ("min_void_angle_rad", "min_void_angle"),
        ("status", "status"),
    ):
        columns[column] = sweep[name].transpose("direction", "frequency").values.ravel()
    return columns
