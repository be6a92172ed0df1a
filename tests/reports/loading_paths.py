"""Draws and measures studies along a loading path, for tests."""

import dataclasses

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from pipeline.problem import Output
from reports.base import style
from reports.facts import fact_records
from reports.figures.loading_path import facts as path_facts
from reports.figures.loading_path import figure
from reports.study import StudyResults
from tests.reports import figure_assertions


def made(study: StudyResults) -> Figure:
    """Draws the figure of a study along its loading path."""
    with style.styled():
        return figure_assertions.drawn(figure.loading_path_figure(study).draw())


def changed(study: StudyResults, name: Output, made: xr.Dataset) -> StudyResults:
    """Returns a study with another dataset of a kind."""
    return dataclasses.replace(study, datasets={**study.datasets, name: made})


def values(study: StudyResults) -> dict[str, fact_records.Fact]:
    """Lists the facts of such a study by their keys."""
    known = fact_records.quoted(path_facts.loading_path_facts(study), study.problem.report.paper)
    return {fact.key: fact for fact in known}


def motion(study: StudyResults, structure: str) -> np.ndarray:
    """Returns the motion (n_times, n_units, 3) of a structure under the first load case."""
    found = study.response["displacement"].sel(structure=structure).isel(case=0)
    return np.asarray(found.values)
