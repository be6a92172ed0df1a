"""Stage: simulates the altered and the cloaked structure of a design, with error estimates."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline import cli, problem
from pipeline.errors import UserError

if TYPE_CHECKING:
    import xarray as xr

    from pipeline.problem import Problem
    from sim.batch import Case, Measure, Solved
    from sim.observables import Observables
    from sim.plan import Plan
    from sim.scene import Scene

LOG = logging.getLogger(__name__)

Floats = NDArray[np.float64]
STRUCTURES = ("altered", "cloaked")
CLEARANCE_STRIDE = 4
"""Gaps and overlaps in motion are looked for in every so many samples."""


def parser() -> argparse.ArgumentParser:
    """The stage's command line."""
    made = cli.parser("pipeline.simulate", "Simulate the structures of a design.")
    made.add_argument("--design", type=Path, required=True, metavar="NC", help="the design")
    made.add_argument("--out", type=Path, required=True, metavar="NC", help="dataset to write")
    made.add_argument("--threads", type=int, default=1, help="cases simulated side by side")
    return made


def work(args: argparse.Namespace) -> None:
    """Reads problem and design, simulates both structures, writes their response."""
    from pipeline import datasets, provenance
    from pipeline.scenes import scene_of
    from pipeline.structures import flat_vertices

    asked = problem.load(args.problem, args.preset)
    design = datasets.read(args.design, "design")
    scene = scene_of(asked, args.problem.parent)
    shapes = {
        "altered": flat_vertices(scene.lattice, design["vertices_initial"]),
        "cloaked": flat_vertices(scene.lattice, design["vertices"]),
    }
    made, plans = response_dataset(asked, scene, shapes, args.threads)
    origin = provenance.attributes(asked, "simulate", parents={"design": args.design}, plan=plans)
    datasets.write(made, args.out, "response", origin)


class Times(NamedTuple):
    """When the response is wanted.

    Attributes:
        asked: all times, ascending, s.
        shown, integrated, sampled: where in them the response's own samples are, those of the
            loss's integral, and those of the authors' sum.
    """

    asked: Floats
    shown: NDArray[np.int64]
    integrated: NDArray[np.int64]
    sampled: NDArray[np.int64]


def times_of(asked: Problem, scene: Scene) -> Times:
    """Output times of a problem's response."""
    from sim.plan import sample_times

    horizon = scene.duration
    end = (
        horizon
        if asked.frequency is None
        else max(horizon, asked.response.cycles / asked.frequency)
    )
    shown = np.linspace(0.0, end, asked.response.samples)
    wanted = (shown, sample_times(scene), np.linspace(0.0, horizon, asked.horizon.samples))
    nanoseconds = [np.round(times * 1e9).astype(np.int64) for times in wanted]
    every, place = np.unique(np.concatenate(nanoseconds), return_inverse=True)
    ends = np.cumsum([len(times) for times in wanted])[:-1]
    return Times(np.asarray(every * 1e-9), *np.split(place, ends))


class Measured(NamedTuple):
    """What is kept of a simulated case."""

    displacement: Floats
    velocity: Floats
    observables: Observables
    smallest_gap: float
    overlaps: int
    loss: float
    loss_samples: float
    loss_error: float
    displacement_error: float


def response_dataset(
    asked: Problem, scene: Scene, shapes: dict[str, Floats], threads: int
) -> tuple[xr.Dataset, dict[str, object]]:
    """The dataset ``response`` of the structures, and the plan of each."""
    from sim.batch import run_batch
    from sim.plan import make_plan

    times = times_of(asked, scene)
    measured: dict[str, list[Measured]] = {}
    plans: dict[str, object] = {}
    with cli.progress(len(shapes) * len(scene.motions), "response") as bar:
        for name, vertices in shapes.items():
            plan = make_plan(scene, vertices, times.asked, every_case=True)
            plans[name] = plan.record()
            LOG.info("%s: %s", name, plan.describe())
            cases = _cases(scene, vertices, plan)
            reduce = _measure(scene, vertices, times)
            measured[name] = []
            for outcome in run_batch(cases, reduce, threads):
                if outcome.value is None:
                    raise UserError(
                        f"the {name} structure cannot be simulated: {outcome.failure}",
                        remedy="lower drive.amplitude, or ask for solver.accuracy: tight",
                    )
                measured[name].append(outcome.value)
                bar.update(loss=outcome.value.loss)
    return _dataset(asked, scene, shapes, times.asked[times.shown], measured), plans


def _cases(scene: Scene, vertices: Floats, plan: Plan) -> Iterator[Case]:
    from sim.batch import Case
    from sim.plan import concrete_parameters

    values = concrete_parameters(scene, vertices)
    return (Case(values, drive, plan.solver) for drive in scene.drives)


def _measure(scene: Scene, vertices: Floats, times: Times) -> Measure[Measured]:
    import jax.numpy as jnp

    from sim.clearance import clearance
    from sim.dynamics import solve_case
    from sim.evaluation import objective
    from sim.observables import observe

    integral = objective(scene)
    mean = integral._replace(weights=np.full(len(times.sampled), 1 / len(times.sampled)))

    def reduce(solved: Solved) -> Measured:
        case, displacement = solved.case, solved.displacement
        finer = case.solver.refined(solved.record)
        refined, _, _ = solve_case(finer, case.values, case.drive)
        refined = refined.reshape(displacement.shape)
        whole, fine = displacement[times.integrated], refined[times.integrated]
        loss, fine_loss = (
            float(integral(jnp.asarray(motion[None]), case.values)[0]) for motion in (whole, fine)
        )
        sampled = float(mean(jnp.asarray(displacement[None, times.sampled]), case.values)[0])
        shown = displacement[times.shown]
        found = clearance(scene.lattice, vertices, shown[::CLEARANCE_STRIDE])
        scale = np.array([scene.lattice.spacing, scene.lattice.spacing, 1.0])
        region, fine_region = whole[:, scene.region] / scale, fine[:, scene.region] / scale
        return Measured(
            shown,
            solved.velocity[times.shown],
            observe(scene.topology, case.values, shown),
            float(found.gap.min()),
            int(found.overlaps.max()),
            loss,
            sampled,
            abs(loss - fine_loss) / fine_loss,
            float(np.linalg.norm(region - fine_region) / np.linalg.norm(fine_region)),
        )

    return reduce


def _dataset(
    asked: Problem,
    scene: Scene,
    shapes: dict[str, Floats],
    times: Floats,
    measured: dict[str, list[Measured]],
) -> xr.Dataset:
    import xarray as xr

    from pipeline.design import case_directions
    from pipeline.structures import network_variables, unit_coordinates

    def gather(name: str) -> Floats:
        return np.stack([[getattr(case, name) for case in cases] for cases in measured.values()])

    def observed(name: str) -> Floats:
        return np.stack(
            [[getattr(case.observables, name) for case in cases] for cases in measured.values()]
        )

    motion = ("structure", "case", "time", "unit", "dof")
    history, case = motion[:3], motion[:2]
    variables = {
        **network_variables(asked, scene),
        "vertices": (
            ("structure", "unit", "vertex", "xy"),
            np.stack([scene.lattice.padded(vertices) for vertices in shapes.values()]),
        ),
        "displacement": (motion, gather("displacement")),
        "velocity": (motion, gather("velocity")),
        "reaction_force": (motion, observed("reaction")),
        "strain_energy": (history, observed("strain_energy")),
        "contact_energy": (history, observed("contact_energy")),
        "min_void_angle": (history, observed("void_angle")),
        "min_gap": (case, gather("smallest_gap")),
        **{
            name: (case, gather(name))
            for name in ("overlaps", "loss", "loss_samples", "loss_error", "displacement_error")
        },
    }
    directions = case_directions(asked)
    nothing = [np.nan] * len(directions)
    amplitude = getattr(asked.drive, "amplitude", np.nan)
    coordinates = {
        **unit_coordinates(scene.lattice),
        "structure": (("structure",), list(shapes)),
        "direction": (("case",), np.rad2deg(directions)),
        "frequency": (
            ("case",),
            nothing if asked.frequency is None else [asked.frequency] * len(nothing),
        ),
        "amplitude": (("case",), [amplitude] * len(nothing)),
        "time": (("time",), times),
        "dof": (("dof",), ["ux", "uy", "theta"]),
    }
    return xr.Dataset(variables, coordinates)


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    return cli.run(work, parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
