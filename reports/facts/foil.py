"""States how far the foil of the ligaments is strained by the loads of a study."""

from collections.abc import Iterator

import jax
import numpy as np
import xarray as xr

from pipeline.posing import altered_lattice_of, flat_vertices, lattice_of, material_of
from pipeline.problem import Problem
from reports.facts.fact_records import Fact, facts_of, percent
from reports.study import display_name
from sim.core import Floats
from sim.scene import foil_strains
from sim.structure import parameters_at

_told = facts_of(__file__)
_strains = jax.jit(foil_strains, static_argnames="thickness")


def strain_facts(problem: Problem, response: xr.Dataset) -> Iterator[Fact]:
    """Yields the largest strain of a shim in every structure, against its limit."""
    limit = strain_limit(problem)
    for name, strains in largest_strains(problem, response).items():
        case, bend = int(strains.argmax()), response["max_bend"].sel(structure=name)
        yield _told(
            "shim_strain_{name}",
            float(strains[case]),
            name=name,
            words=display_name(problem, name).lower(),
            foil=problem.shim_thickness,
            bend=np.degrees(float(bend.max())),
            limit=percent(limit),
            kept="kept" if strains[case] <= limit else "exceeded",
        )


def strain_warning(problem: Problem, response: xr.Dataset) -> Iterator[str]:
    """Yields a line on the structures whose shims exceed their limit, if there are any."""
    limit, found = strain_limit(problem), largest_strains(problem, response)
    over = [
        f"{display_name(problem, name).lower()} {percent(s.max())}"
        for name, s in found.items()
        if s.max() > limit
    ]
    if over:
        yield (
            f"shims of {problem.shim_thickness:g} mm are strained beyond {percent(limit)}:"
            f" {', '.join(over)}; take thinner foil or a smaller load, or ask for"
            " constraints.shim_strain"
        )


def strain_limit(problem: Problem) -> float:
    """Returns the strain that the foil's faces are to keep to."""
    asked = problem.constraints.shim_strain
    return problem.report.shim_strain_limit if asked is None else asked


def largest_strains(problem: Problem, response: xr.Dataset) -> dict[str, Floats]:
    """Computes the largest strain (n_cases,) of any shim over time, by structure."""
    found = {}
    for name in (str(name) for name in response["structure"].values):
        part = response.sel(structure=name)
        lattice = lattice_of(problem) if name == "intact" else altered_lattice_of(problem)
        vertices = flat_vertices(lattice, part["vertices"])
        values = parameters_at(lattice, vertices, material_of(problem, lattice))
        motion = part["displacement"].transpose("case", "time", "unit", "dof").values
        ends = motion[:, :, lattice.id][:, :, lattice.ligament_units]
        strains = [_strains(one, values, thickness=problem.shim_thickness) for one in ends]
        found[name] = np.array([float(np.abs(strain).max()) for strain in strains])
    return found
