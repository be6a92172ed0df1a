"""Stage: optimises the cloak of a problem by one method and writes the design with its history."""

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
    law_comparison,
    limits_of,
    load_family,
    loss_units,
    network_variables,
    spread,
    start_vector,
    times_of,
    unit_coordinates,
)
from pipeline.problem import Problem
from pipeline.problem.sections import Methods
from pipeline.runtime import UserError, cli, source_hash
from sim.constraints import margins
from sim.core import Floats, SimulationError
from sim.load_family import FamilyOptions, minimise_worst
from sim.optimise import (
    Evaluation,
    InfeasibleStartError,
    Journal,
    JournalInUseError,
    MmaOptions,
    Result,
    SqpOptions,
    UnconfirmedError,
)
from sim.scene import Paths, Plan, Scene, constraints_of, make_plan, minimise
from sim.structure import overlapping_pairs, shape, smallest_gap

LOG = logging.getLogger(__name__)

NO_DESIGN = (InfeasibleStartError, SimulationError)
"""Errors that end one descent without a design, while others go on."""


def work(args: argparse.Namespace) -> None:
    """Reads the problem, optimises, writes the design.

    Raises:
        UserError: a fault of the problem, no feasible start, or a start that cannot be simulated
            or is none of this problem's.
    """
    asked = problem.load(args.problem, args.preset)
    if asked.designs is not None:
        what = "the problem asks for several designs"
        remedy = "name one by its number, as in --preset 1"
        raise UserError(what, file=args.problem, key="designs", remedy=remedy)
    scene = design_scene(asked, args.problem.parent)
    start = start_vector(asked, scene, args.start, args.problem)
    plan = _plan(scene, args)
    results = _descents(asked, scene, plan, start, args)
    ended = [each for each in results if each is not None]
    made = design_dataset(asked, scene, min(ended, key=lambda each: (each.violation, each.loss)))
    parents = {} if args.start is None else {"start": args.start}
    losses = [None if each is None else each.loss for each in results]
    found = plan.record() | {"descents": losses}
    origin = provenance.of_study(asked, "design", method=args.method, parents=parents, plan=found)
    datasets.write(made, args.out, "design_method", origin)


def _descents(
    asked: Problem, scene: Scene, plan: Plan, start: Floats | None, args: argparse.Namespace
) -> list[Result | None]:
    """Optimises with every seed; None stands for a descent that ends without a design.

    Raises:
        UserError: why the first does, where all do.
    """
    found: list[Result | None] = []
    first: UserError | None = None
    for number, posed in enumerate(every := _with_seeds(asked, args.method)):
        kicked = _perturb_start(start, number, posed, scene)
        try:
            found.append(_descend(posed, scene, plan, kicked, args))
        except UserError as error:
            if len(every) == 1 or not isinstance(error.__cause__, NO_DESIGN):
                raise
            place = number + 1, len(every)
            LOG.warning("descent %d of %d ends without a design: %s", *place, error.what)
            found.append(None)
            first = first or error
    if first is not None and not any(found):
        raise first
    return found


def _with_seeds(asked: Problem, method: str) -> list[Problem]:
    """Poses the problem with the seed of each descent; MMA has no use for any."""
    first, count = asked.optimiser.seed, asked.optimiser.descents if method == "sqp" else 1
    return [asked.with_optimiser(seed=seed) for seed in range(first, first + count)]


def _perturb_start(
    start: Floats | None, number: int, asked: Problem, scene: Scene
) -> Floats | None:
    """Shifts the start of every descent but the first at random, by the optimiser's kick."""
    if number == 0:
        return start
    kick, random = asked.optimiser.kick, np.random.default_rng([asked.optimiser.seed, number])
    return (0.0 if start is None else start) + random.uniform(-kick, kick, scene.space.n_variables)


def _plan(scene: Scene, args: argparse.Namespace) -> Plan:
    plan = make_plan(scene, threads=args.threads)
    LOG.info("%s", plan.describe())
    return plan


def _descend(
    asked: Problem, scene: Scene, plan: Plan, start: Floats | None, args: argparse.Namespace
) -> Result:
    """Optimises with one seed; a design for contact on distance first by the angle law, if asked.

    That may overlap and snap on its way, and ends in better designs than what may not.
    """
    first, (source, results) = asked.optimiser.angle, (args.problem, args.out.parent)
    if first is not None and asked.contact.law == "geometric" and args.method == "sqp":
        by_angle = law_comparison.under(asked, "angle").with_optimiser(methods=Methods(sqp=first))
        free = asked.objective.model_copy(update={"snap": "allow"})
        by_angle = by_angle.model_copy(update={"objective": free})
        other = design_scene(by_angle, source.parent)
        LOG.info("first by the angle law")
        start = optimise(by_angle, other, _plan(other, args), "sqp", source, results, start).x
    result = optimise(asked, scene, plan, args.method, source, results, start)
    LOG.info("stopped: %s; loss %.5g", result.reason, result.loss)
    return result


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
        what = f"the problem does not ask for the method {method}"
        remedy = f"add optimiser.methods.{method}.evaluations"
        raise UserError(what, file=source, key="optimiser.methods", remedy=remedy)
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
                options, family = _options(asked, method), load_family(asked, source.parent)
                if family is not None and isinstance(options, SqpOptions):
                    return minimise_worst(
                        scene,
                        family,
                        limits_of(asked),
                        start,
                        sqp=options,
                        options=_family_options(asked),
                        journal=journal,
                        callback=show,
                    )
                return minimise(
                    scene,
                    limits_of(asked),
                    start,
                    options=options,
                    plan=replace(plan, passed=times_of(asked, scene).asked),
                    journal=journal,
                    paths=Paths(folder / f"{method}.paths"),
                    callback=show,
                )
        except InfeasibleStartError as error:
            constraints = constraints_of(scene, plan, limits_of(asked))
            raise failures.infeasible_start(error, constraints, source) from error
        except UnconfirmedError as error:
            raise failures.unconfirmed(error, asked, source) from error
        except SimulationError as error:
            name = "initial" if start is None else "starting"
            stopped = failures.StoppedError(error, scene, name, plan.solver.output_times)
            raise stopped.explain(asked, source) from error
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


def _family_options(asked: Problem) -> FamilyOptions:
    ranges = asked.objective.loads
    assert ranges is not None
    return FamilyOptions(ranges.sharpness, ranges.nominal, ranges.search_every)


def design_dataset(asked: Problem, scene: Scene, result: Result) -> xr.Dataset:
    """Makes the dataset ``design_method`` of an optimisation."""
    lattice, history = scene.lattice, result.evaluations
    intact = lattice_of(asked)
    vertices = np.asarray(scene.space.vertices(result.x))
    angles = np.asarray(scene.space.end_angles(result.x)) if scene.space.turning else None
    found = margins(lattice, vertices, limits_of(asked), angles)
    slots = np.full((intact.n_ligaments, 2), np.nan)
    if angles is not None:
        slots[np.isin(intact.id[intact.ligament_units], lattice.id).all(axis=1)] = angles
    violation = np.array([e.violation for e in history])
    violation[result.best] = result.violation  # as confirmed
    cases = len(case_directions(asked))
    nothing = np.full(cases, np.nan)

    def whole(values: Floats) -> Floats:
        return spread(values, lattice, intact.n_units)

    variables = {
        **network_variables(asked, scene),
        "vertices": (("unit", "vertex", "xy"), whole(lattice.padded(vertices))),
        "vertices_initial": (("unit", "vertex", "xy"), intact.padded(intact.vertices)),
        "end_angles": (("ligament", "end"), slots),
        "centroid": (("unit", "xy"), whole(np.asarray(shape(lattice, vertices).centroid))),
        "constraint_margin": (("constraint",), [margin.value for margin in found.values()]),
        "smallest_gap": ((), smallest_gap(lattice, vertices).distance),
        "overlaps": ((), len(overlapping_pairs(lattice, vertices))),
        "loss": (("evaluation",), [e.loss for e in history]),
        "loss_case": (
            ("evaluation", "case"),
            np.stack([nothing if e.failure else e.aux[:cases] for e in history]),
        ),
        "violation": (("evaluation",), violation),
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
        "constraint": (("constraint",), list(found)),
        "constraint_units": (("constraint",), [margin.unit for margin in found.values()]),
    }
    made = xr.Dataset(variables, coordinates)
    for name in ("loss", "loss_case", "best_loss"):
        made[name].attrs["units"] = loss_units(asked)
    return made
