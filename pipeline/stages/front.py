"""Stage: losses of several designs under the drive's own loads and under the worst of a family."""

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.posing import case_directions, loss_units, read_design, scene_of, structures_of
from pipeline.problem.sections import split_name
from pipeline.runtime import UserError, cli, source_hash
from pipeline.stages.certify import (
    BatchedLosses,
    loads_in_ranges,
    losses_journal,
    nominal_places,
)
from pipeline.stages.robust_gains import named_designs
from sim.load_family import spread_places
from sim.optimise import Journal

SPREAD, SEARCHES = 32, 4
"""Loads spread over the family, and searches of the worst one from the worst of these."""
SEED = 0


class FrontPoint(NamedTuple):
    """Holds one design: what sets it apart, and its losses, as the dataset `front` has them."""

    parameter: str
    setting: str
    nominal_loss: float
    worst_loss: float
    worst_direction: float
    worst_amplitude: float
    worst_frequency: float
    altered_loss: float


def work(args: argparse.Namespace) -> None:
    """Reads the designs, searches the worst load of each, writes the front.

    Raises:
        UserError: there are no designs, or one is none of several, or asks for no family of loads.
    """
    given = named_designs(args.designs)
    if not given:
        what = "no preset asks for several designs under loads in ranges"
        remedy = "add one with objective.loads and designs, such as unbiased_share of Figure 2"
        raise UserError(what, file=args.problem, key="presets", remedy=remedy)
    made = front(args.problem, given, args.out, args.threads)
    origin = provenance.of_study(problem.load(args.problem), "front", parents=given)
    datasets.write(made, args.out, "front", origin)


def front(path: Path, designs: Mapping[str, Path], out: Path, threads: int) -> xr.Dataset:
    """The dataset ``front`` of designs by name, such as ``unbiased_edge.2``.

    Each has a journal beside the file ``out``, so that another design leaves theirs as they are.
    """
    each = SPREAD + SEARCHES + len(case_directions(problem.load(path))) + 1
    rows = []
    with cli.progress(len(designs) * each, "loads") as bar:
        for name, design in designs.items():
            section = problem.section_hash(problem.load(path, name), "front")
            words = (source_hash("pipeline.stages.front"), section, provenance.file_hash(design))
            with losses_journal(out, "front", words) as journal:
                rows.append(_point(path, name, design, journal, threads, bar.update))
    columns = {
        name: (("design",), list(column))
        for name, column in zip(FrontPoint._fields, zip(*rows, strict=True), strict=True)
    }
    made = xr.Dataset({"design": list(designs), **columns})
    for name in ("nominal_loss", "worst_loss", "altered_loss"):
        made[name].attrs["units"] = loss_units(problem.load(path))
    return made


def _point(
    path: Path,
    name: str,
    design: Path,
    journal: Journal,
    threads: int,
    done: Callable[[int], None],
) -> FrontPoint:
    asked, (preset, number) = problem.load(path, name), split_name(name)
    several = problem.load(path, preset).designs
    if several is None or number is None:
        remedy = f"give one of a preset with `designs`, such as {name}.1={design}"
        what = "one of several designs is wanted here"
        raise UserError(what, key="--designs", value=name, remedy=remedy)
    ((parameter, settings),) = several.items()
    family, scene = loads_in_ranges(asked, path), scene_of(asked, path.parent)
    structures = structures_of(scene, read_design(asked, design))
    tried = BatchedLosses(*structures["cloaked"], family, journal, threads, done)
    own = tried.losses(nominal_places(scene, family))
    spread = spread_places(family, SPREAD, SEED)
    worst_first = np.argsort(-tried.losses(spread))
    found = tried.searches(spread[worst_first[:SEARCHES]])
    worst = found[found[:, -1].argmax()]
    altered = BatchedLosses(*structures["altered"], family, journal, threads, done)
    direction, amplitude, *frequency = np.asarray(family.numbers(worst[:-1]))
    return FrontPoint(
        parameter,
        str(settings[number - 1]),
        float(own @ scene.loads.case_weights),
        # searches may have come to no load that can be simulated
        float(worst[-1]) if np.isfinite(worst[-1]) else np.nan,
        float(np.rad2deg(direction)),
        float(amplitude),
        float(frequency[0]) if frequency else np.nan,
        float(altered.losses(worst[None, :-1])[0]),
    )
