"""A structure as variables of a dataset, and back."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.problem import Problem
from pipeline.scenes import clamped_dofs, driven_units
from sim.lattice import Lattice
from sim.scene import Scene

Floats = NDArray[np.float64]
Variables = dict[str, tuple[tuple[str, ...], Any]]

SURROUNDINGS, CLOAK, SOURCE = 0, 1, 2
FREE, CLAMPED, DRIVEN = 0, 1, 2


def unit_coordinates(lattice: Lattice) -> Variables:
    """Labels of the units and of the specimen frame's axes."""
    return {
        "unit": (("unit",), np.arange(lattice.n_units)),
        "i": (("unit",), lattice.index[:, 0]),
        "j": (("unit",), lattice.index[:, 1]),
        "xy": (("xy",), ["x", "y"]),
    }


def network_variables(problem: Problem, scene: Scene) -> Variables:
    """Regions, supports and ligaments of a scene."""
    lattice = scene.lattice
    region = np.full(lattice.n_units, SURROUNDINGS, dtype=np.int8)
    region[scene.cloak] = CLOAK
    region[scene.driven] = SOURCE
    interest = np.zeros(lattice.n_units, dtype=np.int8)
    interest[scene.region] = 1
    support = np.full(lattice.n_units, FREE, dtype=np.int8)
    support[np.unique(clamped_dofs(problem) // 3)] = CLAMPED
    support[driven_units(problem)] = DRIVEN
    local = lattice.ligaments - lattice.first_vertex[lattice.ligament_units]
    return {
        "region": (("unit",), region),
        "roi": (("unit",), interest),
        "support": (("unit",), support),
        "ligament_unit": (("ligament", "end"), lattice.ligament_units),
        "ligament_vertex": (("ligament", "end"), local),
    }


def flat_vertices(lattice: Lattice, vertices: xr.DataArray) -> Floats:
    """Vertices (n_vertices, 2) of a padded array (unit, vertex, xy), in the lattice's order."""
    local = np.arange(lattice.n_vertices) - lattice.first_vertex[lattice.unit]
    return np.asarray(vertices.transpose("unit", "vertex", "xy").values[lattice.unit, local])
