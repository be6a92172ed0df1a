"""Stage: what the robust presets of a study gain over its own design, as a table."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline import cli, problem
from pipeline.errors import UserError

if TYPE_CHECKING:
    from pipeline.problem import Problem
    from sim.scene import Scene

LOG = logging.getLogger(__name__)

PLAIN = "plain"
COLUMNS = ("preset", "loads", "copies", "plain_design", "own_design", "gain", "own_under_drive")
_HELD_OUT = 16  # imperfect copies that no design was made for
_SEED = 1000


def parser() -> argparse.ArgumentParser:
    """The stage's command line."""
    made = cli.parser(
        "pipeline.gains",
        "Evaluate the robust loss of every preset with objective.robust at the study's own design"
        " and at the preset's.",
    )
    told = "the study's own design as plain=NC, and one for each preset"
    made.add_argument("--designs", nargs="+", required=True, metavar="PRESET=NC", help=told)
    made.add_argument("--out", type=Path, required=True, metavar="CSV", help="table to write")
    return made


def work(args: argparse.Namespace) -> None:
    """Reads the designs, evaluates them, writes and tells the table.

    Raises:
        UserError: no design of the study itself is given, or none of a preset.
    """
    import csv

    from pipeline.whole import whole

    given = dict(_named(text) for text in args.designs)
    presets = [name for name in given if name != PLAIN]
    if PLAIN not in given or not presets:
        what = "a design of the study itself and one of a preset are compared"
        remedy = "give plain=results/fig2/design.nc broadband=results/fig2@broadband/design.nc"
        raise UserError(what, key="--designs", remedy=remedy)
    rows = []
    with cli.progress(len(presets), "robust losses") as bar:
        for preset in presets:
            rows.append(_row(args.problem, preset, given[PLAIN], given[preset]))
            bar.update()
    with whole(args.out) as aside, aside.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows(rows)
    for row in rows:
        pairs = zip(COLUMNS, row, strict=True)
        LOG.info("%s", ", ".join(f"{name} {value}" for name, value in pairs))


def _named(text: str) -> tuple[str, Path]:
    name, _, path = text.rpartition("=")
    return name, Path(path)


def _row(path: Path, preset: str, plain: Path, own: Path) -> tuple[str, ...]:
    """One line of the table; copies are others than the design was made with."""
    asked, drive = problem.load(path, preset), problem.load(path)
    robust = asked.objective.robust
    if robust is None:
        what, remedy = "the preset has no objective.robust", "give presets with it"
        raise UserError(what, file=path, value=preset, remedy=remedy)
    folder = path.parent
    before, after = (_loss(_held_out(asked), folder, design) for design in (plain, own))
    alone = _loss(drive, folder, own)
    counts = 1 + len(robust.loads), _HELD_OUT if robust.copies else 0
    gain = f"{1 - after / before:.1%}"
    return preset, *map(str, counts), f"{before:.5g}", f"{after:.5g}", gain, f"{alone:.5g}"


def _held_out(asked: Problem) -> Problem:
    robust = asked.objective.robust
    assert robust is not None
    copies = _HELD_OUT if robust.copies else 0
    other = robust.model_copy(update={"copies": copies, "seed": robust.seed + _SEED})
    objective = asked.objective.model_copy(update={"robust": other})
    return asked.model_copy(update={"objective": objective})


def _loss(asked: Problem, folder: Path, path: Path) -> float:
    from pipeline import datasets
    from pipeline.robust import design_scene
    from pipeline.structures import flat_vertices

    scene = design_scene(asked, folder)
    design = datasets.read(path, "design")
    vertices = flat_vertices(scene.lattice, design["vertices"])
    shifts = [0.0] if scene.copies is None else scene.copies[:, scene.lattice.group]
    return float(np.mean([_of(scene, vertices + shift) for shift in shifts]))


def _of(scene: Scene, vertices: NDArray[np.float64]) -> float:
    """The combined loss of one structure."""
    from sim import dynamics
    from sim.evaluation import objective
    from sim.objectives import combined
    from sim.plan import concrete_parameters, make_plan

    plan = make_plan(scene, vertices)
    values = concrete_parameters(scene, vertices)
    drives = [scene.drives[case] for case in plan.simulated]
    motion, *_ = dynamics.forward(plan.solver, values, drives)
    each = objective(scene)(motion, values)[np.searchsorted(plan.simulated, plan.case_of)]
    return float(combined(each, scene.weights, scene.sharpness))


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    return cli.run(work, parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
