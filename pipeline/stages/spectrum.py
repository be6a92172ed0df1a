"""Stage: small vibrations of a design's structures, and waves in the unit cell of its lattice."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.posing import (
    PosedStructure,
    StoppedError,
    Variables,
    case_directions,
    compute_bands,
    lattice_of,
    network_variables,
    read_design,
    scene_of,
    spread,
    structures_of,
    unit_coordinates,
)
from pipeline.problem import Problem
from pipeline.problem.sections import Spectrum
from pipeline.runtime import UserError, cli
from sim.core import Floats, SimulationError
from sim.scene import concrete_parameters, simulate
from sim.vibration import Linear, linearised, modes, transmission

AT_REST, LOADED = "at rest", "loaded"
_MODE = ("structure", "state", "mode")


class Vibrations(NamedTuple):
    """Of one structure about its equilibria: (state, ...), units along the whole lattice."""

    equilibrium: Floats
    frequency: Floats
    mode_shape: Floats
    transmission: Floats


def work(args: argparse.Namespace) -> None:
    """Reads problem and design, writes the spectrum.

    Raises:
        UserError: the problem does not ask for one, or what it asks for cannot be computed.
    """
    asked = problem.load(args.problem, args.preset)
    if asked.spectrum is None:
        what = "the problem asks for no linear analysis"
        remedy = "give the section spectrum, with transmission: {from: 5 Hz, to: 200 Hz}"
        raise UserError(what, file=args.problem, key="spectrum", remedy=remedy)
    try:
        made = spectrum(asked, asked.spectrum, args.problem.parent, args.design)
    except UserError as error:
        error.file = error.file or str(args.problem)
        raise
    except StoppedError as stopped:
        raise stopped.explain(asked, args.problem) from stopped
    origin = provenance.of_study(asked, "spectrum", parents={"design": args.design})
    datasets.write(made, args.out, "spectrum", origin)


def spectrum(asked: Problem, section: Spectrum, folder: Path, design: Path) -> xr.Dataset:
    """The dataset ``spectrum`` of a problem and its design.

    Raises:
        UserError: the lattice has fewer modes, or no unit cell, or it does not hold the strain.
        StoppedError: a structure cannot be followed to a full load.
    """
    scene = scene_of(asked, folder)
    structures = structures_of(scene, read_design(asked, design))
    intact = lattice_of(asked)
    found = []
    with cli.progress(len(structures), "linear analysis") as bar:
        for name, each in structures.items():
            states = _equilibria(name, each)
            directions = case_directions(asked)
            found.append(_vibrations(each, states, section, directions, intact.n_units))
            bar.update()
    vertices = [
        spread(s.scene.lattice.padded(s.vertices), s.scene.lattice, intact.n_units)
        for s in structures.values()
    ]
    parts = Vibrations(*(np.stack(part) for part in zip(*found, strict=True)))
    band = section.transmission
    variables: Variables = {
        **network_variables(asked, scene),
        "vertices": (("structure", "unit", "vertex", "xy"), np.stack(vertices)),
        "equilibrium": (("structure", "state", "unit", "dof"), parts.equilibrium),
        "frequency": (_MODE, parts.frequency),
        "mode_shape": ((*_MODE, "unit", "dof"), parts.mode_shape),
        "transmission": (("structure", "state", "case", "excitation"), parts.transmission),
        **compute_bands(asked, section),
    }
    coordinates: Variables = {
        **unit_coordinates(intact),
        "structure": (("structure",), list(structures)),
        "state": (("state",), state_names(asked)),
        "direction": (("case",), np.rad2deg(case_directions(asked))),
        "dof": (("dof",), ["ux", "uy", "theta"]),
        "mode": (("mode",), np.arange(section.modes)),
        "excitation": (("excitation",), np.linspace(band.start, band.stop, band.points)),
        "compression": (("compression",), list(section.compressions)),
    }
    return xr.Dataset(variables, coordinates)


def state_names(asked: Problem) -> list[str]:
    """Names the equilibria: at rest and, in a static study, under the full load of every case."""
    loads = [f"{np.rad2deg(angle):.4g} deg" for angle in case_directions(asked)]
    if not asked.static:
        return [AT_REST]
    if len(loads) == 1:
        return [AT_REST, LOADED]
    return [AT_REST, *(f"{LOADED}, case {k} ({load})" for k, load in enumerate(loads))]


def _vibrations(
    structure: PosedStructure,
    states: Sequence[Floats],
    section: Spectrum,
    directions: Sequence[float],
    size: int,
) -> Vibrations:
    """Vibrations about equilibria (n_units, 3) of a structure in a lattice of ``size`` units."""
    scene, lattice = structure.scene, structure.scene.lattice
    values = concrete_parameters(scene, structure.vertices)
    found = []
    for state in states:
        made = linearised(scene.topology, values, state)
        frequency, shape = _modes(made, section.modes)
        sent = _transmission(made, structure, section, directions)
        whole = spread(state, lattice, size), spread(shape, lattice, size, axis=1)
        found.append(Vibrations(whole[0], frequency, whole[1], sent))
    return Vibrations(*(np.stack(part) for part in zip(*found, strict=True)))


def _equilibria(name: str, structure: PosedStructure) -> list[Floats]:
    """Finds the equilibria at rest and, in a static study, under the full load of every case."""
    scene, rest = structure.scene, np.zeros((structure.scene.lattice.n_units, 3))
    if not scene.loads.static:
        return [rest]
    end = np.array([scene.loads.duration])
    try:
        response = simulate(scene, vertices=structure.vertices, times=end)
    except SimulationError as error:
        raise StoppedError(error, scene, name, end) from error
    return [rest, *response.displacement[:, 0]]


def _modes(made: Linear, count: int) -> tuple[Floats, Floats]:
    try:
        found = modes(made, count)
    except ValueError as error:
        remedy = "ask for fewer"
        raise UserError(str(error), key="spectrum.modes", value=count, remedy=remedy) from error
    largest = np.linalg.norm(found.shape[..., :2], axis=-1).max(axis=1)
    return found.frequency, found.shape / largest[:, None, None]


def _transmission(
    made: Linear, structure: PosedStructure, section: Spectrum, directions: Sequence[float]
) -> Floats:
    """Root mean square motion (n_cases, n_frequencies) of the region under a unit drive."""
    scene = structure.scene
    unit, dof = np.divmod(made.held, 3)
    along = np.array([[np.cos(angle), np.sin(angle), 0.0] for angle in directions])
    drives = np.where(np.isin(unit, scene.loads.driven)[:, None], along.T[dof], 0.0)
    band = section.transmission
    excited = 2 * np.pi * np.linspace(band.start, band.stop, band.points)
    moved = transmission(made, drives, excited)[:, :, scene.objective.region, :2]
    return np.asarray(np.sqrt((np.abs(moved) ** 2).sum(axis=-1).mean(axis=-1)).T)
