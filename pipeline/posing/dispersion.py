"""Computes waves in the unit cell of a problem's lattice, at rest and compressed."""

import numpy as np

from pipeline.posing.structure_variables import Variables
from pipeline.posing.to_scene import contact_laws, lattice_of, material_of
from pipeline.problem import Problem
from pipeline.problem.sections import Kagome, Spectrum
from pipeline.runtime import UserError
from sim.core import SimulationError
from sim.solvers import concrete
from sim.structure import parameters_at
from sim.vibration import UnitCell, bands, brillouin_path, cell_of, strained


def compute_bands(asked: Problem, wanted: Spectrum) -> Variables:
    """Computes bands of the unit cell at rest and compressed.

    Raises:
        UserError: the lattice has no unit cell, or it does not hold a strain.
    """
    cell = _cell(asked)
    vectors, _ = brillouin_path(cell, wanted.waves)
    found, lateral = [], []
    for share in wanted.compressions:
        try:
            state = strained(cell, np.diag([-share, 0.0]), np.diag([0.0, 1.0]))
        except SimulationError as error:
            raise UserError(
                str(error), key="spectrum.compressions", value=share, remedy="compress it less"
            ) from error
        squares = bands(cell, vectors, state)
        found.append(np.sign(squares) * np.sqrt(np.abs(squares)) / (2 * np.pi))
        lateral.append(state.gradient[1, 1])
    places = np.arange(len(vectors)) / wanted.waves
    return {
        "wave": (("wave",), places),
        "band": (("band",), np.arange(found[0].shape[1])),
        "wave_vector": (("wave", "xy"), vectors),
        "lateral_strain": (("compression",), lateral),
        "band_frequency": (("compression", "wave", "band"), np.stack(found)),
    }


def _cell(asked: Problem) -> UnitCell:
    """Builds the unit cell of the lattice before anything was removed or reshaped."""
    lattice = lattice_of(asked)
    made = parameters_at(lattice, lattice.vertices, material_of(asked, lattice))
    period = (4, 2) if isinstance(asked.lattice, Kagome) else (2, 2)
    try:
        return cell_of(lattice, contact_laws(asked)["angle"], concrete(made), period)
    except ValueError as error:
        what, remedy = str(error), "enlarge the lattice, or leave the section out"
        raise UserError(what, key="spectrum", remedy=remedy) from error
