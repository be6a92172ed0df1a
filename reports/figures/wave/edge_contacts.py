"""Measures contact of neighbours along the top and bottom edges of a structure."""

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from reports.figures.wave.contacts import ContactMeasure
from reports.study import RigidUnits, from_dataset
from sim.core import Mask


def on_edges(structure: RigidUnits) -> Mask:
    """Tells which ligaments (n_ligaments,) run along the top or the bottom row of a lattice."""
    height = structure.site[structure.ligament_unit, 1]
    ends = structure.site[:, 1].min(), structure.site[:, 1].max()
    return np.asarray(np.isin(height, ends).all(axis=1) & (np.ptp(height, axis=1) == 0.0))


def along_edges(problem: Problem, response: xr.Dataset, measure: ContactMeasure) -> xr.DataArray:
    """Measures contact (structure, case, time, ligament) along the edges."""
    whole = from_dataset(response.isel(structure=0), problem.lattice.spacing)
    n_edge = int(on_edges(whole).sum())
    found = np.full(
        (*(response.sizes[dim] for dim in ("structure", "case", "time")), n_edge), np.nan
    )
    for k, name in enumerate(response["structure"].values):
        part = response.sel(structure=name)
        here = on_edges(from_dataset(part, problem.lattice.spacing))
        for case in range(response.sizes["case"]):
            values = measure.of(problem, part.isel(case=case))[:, here]
            found[k, case, :, : values.shape[1]] = values
    dims = ("structure", "case", "time", "ligament")
    known = ("structure", "direction", "time")
    return xr.DataArray(found, {name: response[name] for name in known}, dims)


def edge_contacts(problem: Problem, response: xr.Dataset, measure: ContactMeasure) -> xr.DataArray:
    """Counts contacts (structure, case, time) of neighbours along the top and bottom edges."""
    return (along_edges(problem, response, measure) < measure.begins).sum("ligament")
