"""States how far the foil of the ligaments is strained by its slots and the loads of a study."""

from collections.abc import Iterator
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from pipeline.posing import (
    altered_lattice_of,
    designed_angles,
    flat_vertices,
    lattice_of,
    material_of,
)
from pipeline.problem import Problem
from reports.facts.fact_records import Fact, facts_of, percent
from reports.study import display_name
from sim.core import Floats
from sim.energy import parameters_at_rest
from sim.scene import foil_strains
from sim.structure import Lattice, Material, Parameters, arrays_of, parameters_at, shape

_told = facts_of(__file__)
_counted_from_rest = jax.jit(parameters_at_rest)
_strains = jax.jit(foil_strains, static_argnames="thickness")


class ShimExtremes(NamedTuple):
    """Holds the extremes of all shims of a structure over time, from straight foil."""

    strain: Floats  # (n_cases,) largest at a face
    bend: Floats  # (n_cases,) largest turn between the two ends, rad


def strain_facts(problem: Problem, design: xr.Dataset, response: xr.Dataset) -> Iterator[Fact]:
    """Yields the largest strain of a shim in every structure, against its limit."""
    limit = strain_limit(problem)
    for name, (strains, bends) in shim_extremes(problem, design, response).items():
        strain = float(strains.max())
        yield _told(
            "shim_strain_{name}",
            strain,
            name=name,
            words=display_name(problem, name).lower(),
            foil=problem.shim_thickness,
            bend=np.degrees(float(bends.max())),
            limit=percent(limit),
            kept="kept" if strain <= limit else "exceeded",
        )


def strain_warning(problem: Problem, design: xr.Dataset, response: xr.Dataset) -> Iterator[str]:
    """Yields a line on the structures whose shims exceed their limit, if there are any."""
    limit, found = strain_limit(problem), shim_extremes(problem, design, response)
    over = {
        name: f"{display_name(problem, name).lower()} {percent(extremes.strain.max())}"
        for name, extremes in found.items()
        if extremes.strain.max() > limit
    }
    if over:
        words = "take thinner foil or a smaller load"
        if "cloaked" in over and problem.constraints.shim_strain is None:
            words += ", or ask for constraints.shim_strain"
        yield (
            f"shims of {problem.shim_thickness:g} mm are strained beyond {percent(limit)}:"
            f" {', '.join(over.values())}; {words}"
        )


def strain_limit(problem: Problem) -> float:
    """Returns the strain that the foil's faces are to keep to."""
    asked = problem.constraints.shim_strain
    return problem.report.shim_strain_limit if asked is None else asked


def shim_extremes(
    problem: Problem, design: xr.Dataset, response: xr.Dataset
) -> dict[str, ShimExtremes]:
    """Computes the extremes of the shims, by structure.

    A cloak whose slots were designed has shims that are bent before any load.
    """
    found = {}
    for name in (str(name) for name in response["structure"].values):
        part = response.sel(structure=name)
        lattice = lattice_of(problem) if name == "intact" else altered_lattice_of(problem)
        material, vertices = material_of(problem, lattice), flat_vertices(lattice, part["vertices"])
        if name == "cloaked" and (angles := designed_angles(design)) is not None:
            drawn = flat_vertices(lattice, design["vertices"])
            bent = material._replace(end_angles=angles)
            values = _parameters_at_rest(lattice, bent, drawn, vertices)
        else:
            values = parameters_at(lattice, vertices, material)
        motion = part["displacement"].transpose("case", "time", "unit", "dof").values
        ends = motion[:, :, lattice.id][:, :, lattice.ligament_units]
        found[name] = _extremes(ends, values, problem.shim_thickness)
    return found


def _parameters_at_rest(
    lattice: Lattice, material: Material, drawn: Floats, rest: Floats
) -> Parameters[jax.Array]:
    """Computes the parameters of a structure whose vertices (n, 2) came to rest from as drawn."""
    before, after = shape(lattice, drawn), shape(lattice, rest)
    arms = (np.asarray(each.arm)[lattice.first_vertex[:-1]] @ (1.0, 1j) for each in (before, after))
    turn = np.angle(np.conj(next(arms)) * next(arms))
    motion = jnp.column_stack([after.centroid - before.centroid, turn])
    return _counted_from_rest(arrays_of(lattice), parameters_at(lattice, drawn, material), motion)


def _extremes(ends: Floats, values: Parameters[jax.Array], thickness: float) -> ShimExtremes:
    """Computes the extremes of shims whose units move (n_cases, n_times, n_ligaments, 2, 3)."""
    bends = ends[..., 1, 2] - ends[..., 0, 2] - np.asarray(values.natural)[:, 2]
    strains = [float(np.abs(_strains(one, values, thickness=thickness)).max()) for one in ends]
    return ShimExtremes(np.array(strains), np.abs(bends).max(axis=(1, 2)))
