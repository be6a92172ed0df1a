"""Stage: computes the gains of presets with more loads or copies over a study's own design."""

import argparse
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.posing import (
    StoppedError,
    design_scene,
    designed_angles,
    loss_units,
    read_design,
    structures_of,
)
from pipeline.problem import Problem
from pipeline.runtime import UserError, cli
from sim.core import SimulationError
from sim.scene import Scene, at_rest, combined, make_plan, sample_times, simulate

PLAIN = "plain"
HELD_OUT = 16
"""Imperfect copies that a loss is evaluated over, none of them known to a design."""
_SEED = 1000


class Gain(NamedTuple):
    """One preset: what it asks for and the losses under it, as `GAINS` has them."""

    asks: str
    loads: int
    copies: int
    loss_plain: float
    loss_own: float
    loss_altered: float
    price: float


def work(args: argparse.Namespace) -> None:
    """Reads the designs, evaluates them, writes the gains.

    Raises:
        UserError: no design of the study itself is given, or none of a preset, or a preset asks
            for nothing but the study's own drive.
    """
    given = named_designs(args.designs)
    if PLAIN not in given or len(given) == 1:
        what = "a design of the study itself and one of a preset are compared"
        remedy = "give plain=results/fig2/design.nc broadband=results/fig2@broadband/design.nc"
        raise UserError(what, key="--designs", remedy=remedy)
    made = gains(args.problem, given)
    origin = provenance.of_study(problem.load(args.problem), "robust_gains", parents=given)
    datasets.write(made, args.out, "gains", origin)


def named_designs(words: Iterable[str]) -> dict[str, Path]:
    """Reads words such as ``plain=results/fig2/design.nc``: files by name."""
    parts = (word.rpartition("=") for word in words)
    return {name: Path(path) for name, _, path in parts}


def gains(path: Path, designs: Mapping[str, Path]) -> xr.Dataset:
    """Makes the dataset ``gains`` of a problem file, from its own design and those of presets.

    Raises:
        UserError: a preset asks for nothing but the study's own drive, or a structure cannot be
            simulated.
    """
    own = problem.load(path)
    presets = [name for name in designs if name != PLAIN]
    with cli.progress(len(presets) + 1, "losses") as bar:
        drive = _loss(_with_held_out_copies(own), path, designs[PLAIN])
        bar.update()
        rows = []
        for name in presets:
            rows.append(_gain(path, name, designs))
            bar.update()
    columns = {
        name: (("preset",), list(column))
        for name, column in zip(Gain._fields, zip(*rows, strict=True), strict=True)
    }
    made = xr.Dataset({"preset": presets, **columns, "loss_drive": ((), drive)})
    for name in ("loss_plain", "loss_own", "loss_altered", "price", "loss_drive"):
        made[name].attrs["units"] = loss_units(own)
    return made


def _gain(path: Path, preset: str, designs: Mapping[str, Path]) -> Gain:
    """Evaluates one preset; the copies are others than any design was made with."""
    asked, drive = problem.load(path, preset), problem.load(path)
    if not asked.asks_more_than(drive):
        what, remedy = "the preset asks for nothing but the study's own drive", "leave it out"
        raise UserError(what, file=path, value=preset, remedy=remedy)
    robust, held = asked.objective.robust, _with_held_out_copies(asked)
    plain, own = (_loss(held, path, designs[name], preset) for name in (PLAIN, preset))
    return Gain(
        asks=asked.title,
        loads=1 + len(robust.loads if robust else ()),
        copies=HELD_OUT if robust and robust.copies else 0,
        loss_plain=plain,
        loss_own=own,
        loss_altered=_loss(held, path, None, preset),
        price=_loss(_with_held_out_copies(drive), path, designs[preset]),
    )


def _with_held_out_copies(asked: Problem) -> Problem:
    robust = asked.objective.robust
    if robust is None or not robust.copies:
        return asked
    other = robust.model_copy(update={"copies": HELD_OUT, "seed": robust.seed + _SEED})
    objective = asked.objective.model_copy(update={"robust": other})
    return asked.model_copy(update={"objective": objective})


def _loss(asked: Problem, source: Path, path: Path | None, preset: str = PLAIN) -> float:
    """Computes the loss of a design, or of the initial structure; over the copies, if any.

    What is asked is that of a preset, or of the study itself.

    Raises:
        UserError: it cannot be simulated, or one of its copies cannot.
    """
    scene = design_scene(asked, source.parent)
    name, vertices = f"altered ({preset})", scene.lattice.vertices
    if path is not None:
        name, design = f"cloaked ({preset}, {path})", read_design(asked, path)
        scene, vertices = structures_of(scene, design, straight=True)["cloaked"]
        if (angles := designed_angles(design)) is not None:
            scene = scene.bent(angles)
    try:
        return _mean_loss(scene, vertices, name)
    except StoppedError as stopped:
        raise stopped.explain(asked, source) from stopped


def _mean_loss(scene: Scene, vertices: NDArray[np.float64], name: str) -> float:
    copies = scene.design.copies
    if copies is None:
        return _simulate_loss(scene, vertices, name)
    losses = [
        _simulate_loss(
            scene.updated(material=scene.structure.material.scaled(stiffness)),
            vertices + shifts[scene.lattice.group],
            f"{name} (copy {number} of {len(copies)})",
        )
        for number, (shifts, stiffness) in enumerate(
            zip(copies.shifts, copies.stiffness, strict=True), start=1
        )
    ]
    weights = np.full(len(losses), 1.0 / len(losses))
    return float(combined(np.array(losses), weights, scene.objective.copy_sharpness))


def _simulate_loss(scene: Scene, vertices: NDArray[np.float64], name: str) -> float:
    try:
        rest, there = at_rest(scene, vertices)
        plan = make_plan(rest, there, gradient=False)
        return float(simulate(rest, vertices=there, plan=plan).loss)
    except SimulationError as error:
        raise StoppedError(error, scene, name, sample_times(scene)) from error
