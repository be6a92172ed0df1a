"""Stage: simulates the structures of a design with their shims bent as their slots are drawn."""

import argparse
import logging

import numpy as np
import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.fabrication.parts import STRAIGHT, UnbuildableUnitError
from pipeline.fabrication.units import end_angles, network
from pipeline.posing import PosedStructure, failures, read_design, scene_of, structures_of
from pipeline.problem import Problem
from pipeline.runtime import UserError
from pipeline.stages.simulate import StoppedError, response_dataset
from sim.core import Floats, SimulationError
from sim.scene import relaxed

LOG = logging.getLogger(__name__)
_KEY, _REMEDY = "report.as_built", "or leave report.as_built out"


def work(args: argparse.Namespace) -> None:
    """Places the slots, lets the structures come to rest, simulates them from there.

    Raises:
        UserError: a structure cannot be built, or not be followed to its end.
    """
    asked = problem.load(args.problem, args.preset)
    design = read_design(asked, args.design)
    posed = structures_of(scene_of(asked, args.problem.parent), design)
    name = "altered"
    try:
        built = {}
        for name, structure in posed.items():
            built[name] = _built(name, structure, asked, design, args)
        made, plans = response_dataset(asked, built, args.threads)
    except UnbuildableUnitError as error:
        error.remedy = f"{error.remedy}, {_REMEDY}"
        raise
    except SimulationError as error:
        raise _failure(error, name, posed, args, np.zeros(0)) from error
    except StoppedError as stopped:
        raise _failure(stopped.error, stopped.name, posed, args, stopped.asked) from stopped
    origin = provenance.of_study(asked, "as_built", parents={"design": args.design}, plan=plans)
    datasets.write(counted_from_rest(made, asked), args.out, "response", origin)


def _failure(
    error: SimulationError,
    name: str,
    posed: dict[str, PosedStructure],
    args: argparse.Namespace,
    asked: Floats,
) -> UserError:
    """Explains that a structure as built has no equilibrium at rest or under a load."""
    scene = posed[name].scene
    tried = failures.SimulatedStructure(args.problem, scene, f"{name} (as built)", asked)
    return failures.simulation_failure(error, tried, None)


def _built(
    name: str,
    structure: PosedStructure,
    asked: Problem,
    design: xr.Dataset,
    args: argparse.Namespace,
) -> PosedStructure:
    """Bends the shims of a structure, and lets it come to rest; one of straight shims is as it is.

    Raises:
        UnbuildableUnitError: a slot has no room.
        SimulationError: there is no equilibrium.
    """
    scene, vertices = structure
    angles = end_angles(network(design, name), asked.fabrication, args.design)
    if np.abs(angles).max(initial=0.0) < STRAIGHT:
        return structure
    material = scene.structure.material._replace(end_angles=angles)
    rest = relaxed(scene.updated(material=material), vertices)
    turns = np.degrees(np.abs(rest.motion[:, 2]))
    LOG.info("%s: units turn by %.2f deg, at most %.2f, to rest", name, turns.mean(), turns.max())
    return PosedStructure(rest.scene, rest.vertices)


def counted_from_rest(made: xr.Dataset, asked: Problem) -> xr.Dataset:
    """Takes the energy at rest out of losses that are a strain energy."""
    if asked.objective.kind != "strain_energy" or asked.objective.target != "rest":
        return made
    rest = made["roi_energy"].isel(time=0, drop=True)
    losses = ("roi_energy", "loss", "loss_other_branch", "loss_samples", "loss_by_contact")
    return made.assign(
        {name: (made[name] - rest).assign_attrs(made[name].attrs) for name in losses}
    )
