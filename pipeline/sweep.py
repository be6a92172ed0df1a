"""Stage: the loss of a design over load direction and frequency, in parts that are then joined."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline import cli, parts, problem
from pipeline.errors import UserError

if TYPE_CHECKING:
    import xarray as xr

    from pipeline.problem import Problem
    from sim.batch import Outcome, Solved
    from sim.scene import Scene

LOG = logging.getLogger(__name__)

Floats = NDArray[np.float64]


def parser() -> argparse.ArgumentParser:
    """The stage's command line."""
    return parts.parser("pipeline.sweep", "Map the loss over direction and frequency.")


def work(args: argparse.Namespace) -> None:
    """Computes a part of the map, or joins all parts."""
    parts.work(args, _run, "sweep", "frequency")


def _run(args: argparse.Namespace) -> None:
    from pipeline import datasets, provenance
    from pipeline.scenes import scene_of
    from pipeline.structures import flat_vertices

    asked = problem.load(args.problem, args.preset)
    if asked.sweep is None or asked.frequency is None:
        raise UserError(
            "the problem has no sweep over direction and frequency",
            file=args.problem,
            key="sweep",
            remedy="add sweep.direction and sweep.frequency, and a harmonic drive",
        )
    design = datasets.read(args.design, "design")
    scene = scene_of(asked, args.problem.parent)
    shapes = {
        "loss_altered": scene.lattice.vertices,
        "loss": flat_vertices(scene.lattice, design["vertices"]),
    }
    directions, frequencies = axes(asked)
    here = np.array_split(frequencies, args.chunks)[args.chunk]
    made = part(asked, scene, shapes, directions, here, args.threads)
    origin = provenance.attributes(asked, "sweep", parents={"design": args.design})
    datasets.write(made, args.out, "sweep", origin)


def axes(asked: Problem) -> tuple[Floats, Floats]:
    """Directions (rad) and frequencies (Hz) of the map."""
    assert asked.sweep is not None
    wanted = asked.sweep
    return (
        np.linspace(wanted.direction.start, wanted.direction.stop, wanted.direction.points),
        np.linspace(wanted.frequency.start, wanted.frequency.stop, wanted.frequency.points),
    )


def part(
    asked: Problem,
    scene: Scene,
    shapes: dict[str, Floats],
    directions: Floats,
    frequencies: Floats,
    threads: int,
) -> xr.Dataset:
    """The map of both structures at some of the frequencies."""
    import xarray as xr

    size = (len(directions), len(frequencies))
    variables: dict[str, tuple[tuple[str, str], NDArray[np.generic]]] = {}
    with cli.progress(len(shapes) * len(frequencies), "map") as bar:
        for name, vertices in shapes.items():
            losses, voids = np.full(size, np.nan), np.full(size, np.nan)
            status = np.full(size, "ok", dtype=object)
            for column, frequency in enumerate(frequencies):
                for row, outcome in enumerate(
                    _column(asked, scene, vertices, directions, float(frequency), threads)
                ):
                    if outcome.value is None:
                        status[row, column] = outcome.failure
                    else:
                        losses[row, column], voids[row, column] = outcome.value
                bar.update(largest=float(np.nanmax(losses[:, : column + 1])))
            variables[name] = (("direction", "frequency"), losses)
            variables["status"] = (("direction", "frequency"), status)
            variables["min_void_angle"] = (("direction", "frequency"), voids)
    coordinates = {"direction": np.rad2deg(directions), "frequency": frequencies}
    return xr.Dataset(variables, coordinates)


def _column(
    asked: Problem,
    scene: Scene,
    vertices: Floats,
    directions: Floats,
    frequency: float,
    threads: int,
) -> Iterator[Outcome[tuple[float, float]]]:
    """Loss and smallest void angle for each direction at one frequency."""
    from sim.batch import Case, run_batch
    from sim.evaluation import objective, target_motion
    from sim.loads import Harmonic
    from sim.plan import concrete_parameters, make_plan

    assert asked.sweep is not None
    at_frequency = scene.under(
        tuple(
            Harmonic(asked.drive.amplitude, frequency, angle)  # type: ignore[union-attr]
            for angle in directions
        ),
        asked.sweep.periods / frequency,
        frequency,
    )
    plan = make_plan(at_frequency, vertices, threads=threads)
    LOG.debug("%.6g Hz: %s", frequency, plan.describe())
    values = concrete_parameters(at_frequency, vertices)
    target = None if scene.reference is None else target_motion(at_frequency, threads)

    def reduce(solved: Solved) -> tuple[float, float]:
        number = solved.case.number
        measure = objective(at_frequency, None if target is None else target[number : number + 1])
        loss = float(measure(solved.displacement[None], values)[0])
        voids = at_frequency.topology.smallest_void_angle(values.void, solved.displacement)
        return loss, float(voids.min())

    cases = (Case(values, at_frequency.drives[k], plan.solver, int(k)) for k in plan.simulated)
    outcomes = list(run_batch(cases, reduce, threads))
    return (outcomes[k] for k in np.searchsorted(plan.simulated, plan.case_of))


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    return cli.run(work, parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
