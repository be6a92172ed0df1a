"""Converts a structure to variables of a dataset, and back."""

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline import datasets
from pipeline import problem as problems
from pipeline.posing.to_scene import altered_lattice_of, lattice_of
from pipeline.problem import Problem
from pipeline.runtime import UserError
from sim.core import Floats
from sim.scene import DOFS, Scene
from sim.solvers import FORCE
from sim.structure import Lattice

Variables = dict[str, tuple[Any, ...]]

SURROUNDINGS, CLOAK, SOURCE, VOID, INCLUSION = range(5)
FREE, CLAMPED, DRIVEN = range(3)

FEASIBLE = 1e-6
"""Violation of a constraint (mm, rad) up to which a design counts as feasible."""
_ALIKE = 1e-6  # mm


def unit_coordinates(intact: Lattice) -> Variables:
    """Labels the units, removed ones too, and the specimen frame's axes."""
    return {
        "unit": (("unit",), intact.id),
        "i": (("unit",), intact.index[:, 0]),
        "j": (("unit",), intact.index[:, 1]),
        "xy": (("xy",), ["x", "y"]),
    }


def network_variables(problem: Problem, scene: Scene) -> Variables:
    """Lists regions, supports and ligaments of the intact network of a scene."""
    intact, kept = lattice_of(problem), scene.lattice.id
    region = np.full(intact.n_units, VOID, dtype=np.int8)
    region[kept] = SURROUNDINGS
    region[list(problems.inclusion_units(problem))] = INCLUSION
    region[kept[scene.design.cloak]] = CLOAK
    region[kept[scene.loads.driven]] = SOURCE
    interest = np.zeros(intact.n_units, dtype=np.int8)
    interest[kept[scene.objective.region]] = 1
    support = np.full(intact.n_units, FREE, dtype=np.int8)
    support[kept[np.unique(scene.loads.clamped // 3)]] = CLAMPED
    support[kept[scene.loads.driven]] = DRIVEN
    local = intact.ligaments - intact.first_vertex[intact.ligament_units]
    return {
        "region": (("unit",), region),
        "roi": (("unit",), interest),
        "support": (("unit",), support),
        "ligament_unit": (("ligament", "end"), intact.ligament_units),
        "ligament_vertex": (("ligament", "end"), local),
    }


def free_dofs(scene: Scene) -> dict[int, tuple[str, ...]]:
    """Lists the degrees of freedom of clamped and driven units that no load takes, by unit.

    Those along which a force drives are taken.
    """
    loads, lattice = scene.loads, scene.lattice
    taken = np.zeros((lattice.n_units, 3), dtype=bool)
    taken.flat[loads.held] = True
    for case in loads.cases:
        if case.control is not None:
            taken[case.units] |= case.control == FORCE
    supported = np.union1d(loads.clamped // 3, loads.driven)
    return {
        int(lattice.id[unit]): tuple(
            dof for dof, held in zip(DOFS, taken[unit], strict=True) if not held
        )
        for unit in supported.tolist()
        if not taken[unit].all()
    }


def design_hash(design: xr.Dataset) -> str:
    """Hashes the vertices of a design, and angles of slots, to their last bit: 16 hex digits."""
    values = np.ascontiguousarray(design["vertices"].transpose("unit", "vertex", "xy"), "<f8")
    found, angles = hashlib.sha256(values.tobytes()), designed_angles(design)
    if angles is not None:
        found.update(np.ascontiguousarray(angles, "<f8").tobytes())
    return found.hexdigest()[:16]


def present_ligaments(network: xr.Dataset, structure: str = "cloaked") -> NDArray[np.bool_]:
    """Selects the ligaments (n_ligaments,) that a structure of a design or a response has."""
    gone = (network["region"].values == VOID) & (structure != "intact")
    place = np.searchsorted(network["unit"].values, network["ligament_unit"].values)
    return ~gone[place].any(axis=1)


def designed_angles(design: xr.Dataset) -> Floats | None:
    """Reads the angles (n_ligaments, 2) of a cloak's slots, rad; None if they are free."""
    angles = design["end_angles"].transpose("ligament", "end").values
    return None if np.isnan(angles).all() else np.asarray(angles[present_ligaments(design)])


def flat_vertices(lattice: Lattice, vertices: xr.DataArray) -> Floats:
    """Flattens a padded array (unit, vertex, xy) to vertices (n_vertices, 2) of the lattice."""
    local = np.arange(lattice.n_vertices) - lattice.first_vertex[lattice.unit]
    unit = lattice.id[lattice.unit]
    return np.asarray(vertices.transpose("unit", "vertex", "xy").values[unit, local])


def read_design(asked: Problem, path: Path) -> xr.Dataset:
    """Reads a design, which must be one of the problem's lattice and void.

    Raises:
        UserError: it cannot be read, or is of another.
    """
    design = datasets.read(path, "design")
    if not of_problem(asked, design):
        remedy = "give a design of this problem: run python -m pipeline design again"
        raise UserError("the design is of another lattice or void", file=path, remedy=remedy)
    return design


def of_problem(asked: Problem, design: xr.Dataset) -> bool:
    """Tests that a design is one of the problem's lattice and void."""
    intact = lattice_of(asked)
    start, found = intact.padded(intact.vertices), design["vertices_initial"].values
    alike = found.shape == start.shape and np.allclose(found, start, atol=_ALIKE, equal_nan=True)
    if not alike:
        return False
    return not np.isnan(flat_vertices(altered_lattice_of(asked), design["vertices"])).any()


def spread(values: Floats, lattice: Lattice, size: int, axis: int = 0) -> Floats:
    """Spreads an array over a network's units to all ``size`` units, NaN where removed."""
    inner = np.moveaxis(np.asarray(values), axis, 0)
    out = np.full((size, *inner.shape[1:]), np.nan)
    out[lattice.id] = inner
    return np.moveaxis(out, 0, axis)
