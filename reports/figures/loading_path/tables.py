"""Describes data tables of the path: what its curves show, as plain CSV."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from reports.base import Table
from reports.facts import Columns, headed, headed_columns, history, vertices
from reports.figures.loading_path import measures, monte_carlo
from reports.figures.loading_path.abscissa import abscissa_of, load_names, structures
from reports.figures.loading_path.drive_response import drive_response
from reports.figures.loading_path.measures import over_cases
from reports.study import StudyResults


def of_design(study: StudyResults) -> list[Table]:
    """Returns the design and how it was found."""
    text = "vertices of the cloaked and of the initial design"
    return [
        Table("design.csv", text, vertices(study.design)),
        Table("loss_history.csv", "loss against evaluation (panel b)", history(study.design)),
    ]


def by_structure(study: StudyResults, series: Mapping[str, xr.DataArray]) -> Columns:
    """Returns a column for each series of a response and each structure, one row a sample.

    Of several load cases it is their mean, and each has a column besides.
    """
    columns: Columns = {}
    for label, values in series.items():
        mean = over_cases(study.problem, values)
        loads = load_names(study.problem, study.response)
        for name in structures(study.response):
            columns[f"{name}_{label}"] = mean.sel(structure=name).values
            for case, load in enumerate(loads if len(loads) > 1 else ()):
                suffix = load.replace(",", "").replace(" ", "_").replace("°", "deg")
                one = values.sel(structure=name).isel(case=case)
                columns[f"{name}_{label}_{suffix}"] = one.values
    return columns


def path(study: StudyResults) -> Columns:
    """Lists per sample the measure, contraction, reaction, energies, voids of each structure."""
    problem, response = study.problem, study.response
    way = abscissa_of(problem, response)
    measure = measures.measure_of(problem)
    columns: Columns = {"time_s": response["time"].values}
    if way.static:
        columns[way.column] = way.values
    answer = drive_response(problem)
    series = {headed(measure.key, measure.unit): measure.of(response)}
    if measures.contracts_freely(problem, response):
        series["contraction_mm"] = measures.contraction(problem, response)
    series |= {
        headed(answer.key, answer.unit): answer.of(response),
        "strain_energy_Nmm": response["strain_energy"],
        "contact_energy_Nmm": response["contact_energy"],
        "min_void_angle_rad": response["min_void_angle"],
        "eigenvalue_N_per_mm": response["eigenvalue"],
    }
    return columns | by_structure(study, series)


def copies(study: StudyResults, made: xr.Dataset) -> Columns:
    """Returns one row a copy."""
    measure = measures.measure_of(study.problem)
    values = monte_carlo.copy_curves(study.problem, measure, study.response, made)
    values = measures.overall(study.problem, values)
    noise, sample = np.meshgrid(made["noise"].values, made["sample"].values, indexing="ij")
    columns: Columns = {
        "noise": noise.ravel(),
        "sample": sample.ravel(),
        headed(measure.key, measure.unit): values.values.ravel(),
    }
    reaction = made["reaction"].isel(time=-1).values.ravel()
    if np.isfinite(reaction).any():  # a drive that turns or follows a measured motion tells none
        columns["reaction_N"] = reaction
    numbers = ("loss", "min_void_angle", "clashes", "redrawn", "status")
    return columns | headed_columns(made, *numbers)
