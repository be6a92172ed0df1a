"""Data tables of a wave: what the curves show, and the losses with shorter steps, as CSV."""

from __future__ import annotations

import numpy as np
import xarray as xr

from reports.base import Table
from reports.figures.loading_path import Columns, by_structure, measures, of_design
from reports.figures.wave.closed_voids import along_edges
from reports.figures.wave.monitored_places import places
from reports.study import StudyResults


def wave_tables(study: StudyResults) -> list[Table]:
    """All tables, in the order of the panels."""
    tables = [
        *of_design(study),
        Table("waves.csv", "every structure over time (panels d to f)", over_time(study)),
    ]
    if study.verification is not None:
        tables.append(
            Table("steps.csv", "loss and error with shorter steps", steps(study.verification))
        )
    return tables


def over_time(study: StudyResults) -> Columns:
    """One row a sample: u_y where marked, mimicking error, void angles, energies."""
    problem, response = study.problem, study.response
    rise = response["displacement"].sel(dof="uy")
    series = {
        f"uy_{k + 1}_mm": rise.isel(unit=place.unit)
        for k, place in enumerate(places(problem, response))
    }
    series |= {
        "mimicking_error": measures.measure_of(problem).of(response),
        "edge_void_angle_rad": along_edges(problem, response).min("ligament"),
        "strain_energy_Nmm": response["strain_energy"],
        "contact_energy_Nmm": response["contact_energy"],
        "min_void_angle_rad": response["min_void_angle"],
    }
    return {"time_s": response["time"].values} | by_structure(study, series)


def steps(verification: xr.Dataset) -> Columns:
    """One row a check and structure."""
    checks, names = verification["check"].values, verification["structure"].values
    check, structure = np.meshgrid(checks, names, indexing="ij")
    columns: Columns = {"check": check.ravel(), "structure": structure.ravel()}
    for field in ("time_step", "loss", "error", "departure", "min_void_angle", "gap", "overlaps"):
        columns[field] = verification[field].values.ravel()
    return columns
