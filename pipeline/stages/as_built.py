"""Stage: simulates the structures of a design with their shims bent as their slots are drawn."""

import argparse
import logging

import numpy as np

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.fabrication.parts import STRAIGHT, UnbuildableUnitError
from pipeline.fabrication.units import end_angles, network
from pipeline.posing import (
    BENT,
    PosedStructure,
    StoppedError,
    read_design,
    scene_of,
    structures_of,
)
from pipeline.stages.simulate import response_dataset
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
    posed = structures_of(scene_of(asked, args.problem.parent), design, straight=True)
    name = "altered"
    try:
        built, angles = {}, {}
        for name, structure in posed.items():
            angles[name] = end_angles(network(design, name), asked.fabrication, args.design)
            built[name] = _built(name, structure, angles[name])
        made, plans = response_dataset(asked, built, args.threads)
    except UnbuildableUnitError as error:
        error.remedy = f"{error.remedy}, {_REMEDY}"
        raise
    except SimulationError as error:
        stopped = StoppedError(error, posed[name].scene, f"{name} (as built)", np.zeros(0))
        raise stopped.explain(asked, args.problem) from error
    except StoppedError as stopped:
        stopped.name = f"{stopped.name} (as built)"
        raise stopped.explain(asked, args.problem) from stopped
    for name, each in angles.items():
        plans[name]["warnings"] += bent_warning(name, each)
    origin = provenance.of_study(asked, "as_built", parents={"design": args.design}, plan=plans)
    datasets.write(made, args.out, "response", origin)


def bent_warning(name: str, angles: Floats) -> list[str]:
    """Warns of shims of a structure whose ends (n, 2), rad, are bent beyond the ligaments' law."""
    most = np.abs(angles).max(axis=1, initial=0.0)
    if (count := np.count_nonzero(most > BENT)) == 0:
        return []
    return [
        f"as built: {count} of {len(most)} shims of the {name} structure are bent by more than"
        f" {np.degrees(BENT):.0f}° before any load, at most by {np.degrees(most.max()):.0f}°, where"
        " the law of ligaments is an indication only; ask for optimiser.as_built"
    ]


def _built(name: str, structure: PosedStructure, angles: Floats) -> PosedStructure:
    """Bends the shims of a structure, and lets it come to rest; straight ones leave it as it is."""
    scene, vertices = structure
    if np.abs(angles).max(initial=0.0) < STRAIGHT:
        return structure
    rest = relaxed(scene.bent(angles), vertices)
    turns = np.degrees(np.abs(rest.motion[:, 2]))
    LOG.info("%s: units turn by %.2f deg, at most %.2f, to rest", name, turns.mean(), turns.max())
    return PosedStructure(rest.scene, rest.vertices)
