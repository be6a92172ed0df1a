"""Stage: optimises the cloak of a problem by one method and writes the design with its history."""

from __future__ import annotations

import argparse
import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.posing import (
    case_directions,
    design_scene,
    failures,
    lattice_of,
    limits_of,
    loss_units,
    network_variables,
    spread,
    start_vector,
    times_of,
    unit_coordinates,
)
from pipeline.problem import Problem
from pipeline.runtime import UserError, cli, source_hash
from sim.constraints import KIND_NAMES, margins
from sim.core import Floats, SimulationError
from sim.optimise import (
    Evaluation,
    InfeasibleStartError,
    Journal,
    JournalInUseError,
    MmaOptions,
    Result,
    SqpOptions,
)
from sim.scene import Paths, Plan, Scene, constraints_of, make_plan, minimise
from sim.structure import overlapping_pairs, shape, smallest_gap

LOG = logging.getLogger(__name__)


def work(args: argparse.Namespace) -> None:
    """Reads the problem, optimises, writes the design.

    Raises:
        UserError: a fault of the problem, no feasible start, or a start that cannot be simulated
            or is none of this problem's.
    """
    asked = problem.load(args.problem, args.preset)
    if asked.designs is not None:
        raise UserError(
            "the problem asks for several designs",
            file=args.problem,
            key="designs",
            remedy="name one by its number, as in --preset 1",
        )
    scene = design_scene(asked, args.problem.parent)
    _check_symmetry(scene, args.problem)
    plan = make_plan(scene, threads=args.threads)
    LOG.info("%s", plan.describe())
    start = start_vector(asked, scene, args.start, args.problem)
    result = optimise(asked, scene, plan, args.method, args.problem, args.out.parent, start)
    LOG.info("stopped: %s", result.reason)
    made = design_dataset(asked, scene, result)
    parents = {} if args.start is None else {"start": args.start}
    origin = provenance.of_study(
        asked, "design", method=args.method, parents=parents, plan=plan.record()
    )
    datasets.write(made, args.out, "design_method", origin)


def _check_symmetry(scene: Scene, source: Path) -> None:
    try:
        _ = scene.space
    except ValueError as error:
        raise UserError(
            str(error),
            file=source,
            key="optimiser.symmetry",
            value=scene.design.symmetry,
            remedy="ask for none, or for one that lattice and cloak have",
        ) from error


def optimise(
    asked: Problem,
    scene: Scene,
    plan: Plan,
    method: str,
    source: Path,
    results: Path,
    start: Floats | None = None,
) -> Result:
    """Runs the optimiser with a journal in ``results`` and a progress bar.

    It starts from the initial lattice, or from the design vector ``start`` (n_variables,).
    """
    budget = asked.optimiser.methods.chosen.get(method)
    if budget is None:
        raise UserError(
            f"the problem does not ask for the method {method}",
            file=source,
            key="optimiser.methods",
            remedy=f"add optimiser.methods.{method}.evaluations",
        )
    key = problem.section_hash(asked, "design", method)
    folder = results / ".journal" / key[:16]
    folder.mkdir(parents=True, exist_ok=True)
    with cli.progress(budget.evaluations, f"design by {method}") as bar:

        def show(evaluation: Evaluation) -> None:
            bar.update(loss=evaluation.loss, violation=evaluation.violation)

        try:
            with Journal(
                folder / f"{method}.journal", f"{key} {source_hash('pipeline.stages.design')}"
            ) as journal:
                return minimise(
                    scene,
                    limits_of(asked),
                    start,
                    options=_options(asked, method),
                    plan=replace(plan, passed=times_of(asked, scene).asked),
                    journal=journal,
                    paths=Paths(folder / f"{method}.paths"),
                    callback=show,
                )
        except InfeasibleStartError as error:
            constraints = constraints_of(scene, plan, limits_of(asked))
            raise failures.infeasible_start(error, constraints, source) from error
        except SimulationError as error:
            tried = failures.SimulatedStructure(source, scene, "initial", plan.solver.output_times)
            raise failures.simulation_failure(error, tried, None) from error
        except JournalInUseError as error:
            raise UserError(str(error), file=source) from error


def _options(asked: Problem, method: str) -> SqpOptions | MmaOptions:
    wanted = asked.optimiser
    evaluations = wanted.methods.chosen[method].evaluations
    if method == "mma":
        return MmaOptions(evaluations=evaluations)
    return SqpOptions(
        evaluations=evaluations,
        radius=wanted.trust_radius,
        radius_max=wanted.trust_radius_max,
        kick=wanted.kick,
        seed=wanted.seed,
    )


def design_dataset(asked: Problem, scene: Scene, result: Result) -> xr.Dataset:
    """The dataset ``design_method`` of an optimisation."""
    lattice, history = scene.lattice, result.evaluations
    intact = lattice_of(asked)
    vertices = np.asarray(scene.space.vertices(result.x))
    found = margins(lattice, vertices, limits_of(asked))
    cases = len(case_directions(asked))
    nothing = np.full(cases, np.nan)

    def whole(values: Floats) -> Floats:
        return spread(values, lattice, intact.n_units)

    variables = {
        **network_variables(asked, scene),
        "vertices": (("unit", "vertex", "xy"), whole(lattice.padded(vertices))),
        "vertices_initial": (("unit", "vertex", "xy"), intact.padded(intact.vertices)),
        "centroid": (("unit", "xy"), whole(np.asarray(shape(lattice, vertices).centroid))),
        "constraint_margin": (
            ("constraint",),
            [found[kind].value if kind in found else np.nan for kind in KIND_NAMES],
        ),
        "smallest_gap": ((), smallest_gap(lattice, vertices).distance),
        "overlaps": ((), len(overlapping_pairs(lattice, vertices))),
        "loss": (("evaluation",), [e.loss for e in history]),
        "loss_case": (
            ("evaluation", "case"),
            np.stack([nothing if e.failure else e.aux[:cases] for e in history]),
        ),
        "violation": (("evaluation",), [e.violation for e in history]),
        "accepted": (("evaluation",), [int(e.accepted) for e in history]),
        "design_vector": (("evaluation", "variable"), np.stack([e.x for e in history])),
        "best_evaluation": ((), result.best),
        "best_loss": ((), result.loss),
        "kkt_residual": ((), result.stationarity.residual),
    }
    coordinates = {
        **unit_coordinates(intact),
        "direction": (("case",), np.rad2deg(case_directions(asked))),
        "evaluation": (("evaluation",), np.arange(len(history))),
        "constraint": (("constraint",), list(KIND_NAMES)),
        "constraint_units": (
            ("constraint",),
            ["mm" if kind in ("edge_length", "gap") else "rad" for kind in KIND_NAMES],
        ),
    }
    made = xr.Dataset(variables, coordinates)
    for name in ("loss", "loss_case", "best_loss"):
        made[name].attrs["units"] = loss_units(asked)
    return made
