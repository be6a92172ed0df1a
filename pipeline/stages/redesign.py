"""Stage: a design by the angle law under contact on distance, optimised again if that matters."""

import argparse
import logging

import numpy as np

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.posing import closest_vector, design_scene, law_comparison, read_design
from pipeline.problem import Problem
from pipeline.problem.sections import Method, Methods
from pipeline.stages.design import design_dataset, optimise
from pipeline.stages.select import join
from sim.scene import make_plan

LOG = logging.getLogger(__name__)

METHOD = "sqp"


def work(args: argparse.Namespace) -> None:
    """Reads design and response, writes the design for contact on distance.

    The start is the design, or the initial lattice if the design cannot be simulated.

    Raises:
        UserError: neither the design nor the initial lattice can be simulated with that contact.
    """
    asked = problem.load(args.problem, args.preset)
    design = read_design(asked, args.design)
    response = datasets.read(args.response, "response")
    angle, distance = law_comparison.cloak_losses(response, asked.drive.case_weights)
    alike = abs(distance - angle) <= law_comparison.DIFFERENCE * angle
    LOG.info(
        "loss %.5g by angles, %.5g by distances: %s", angle, distance, "kept" if alike else "again"
    )
    posed = with_distance_contact(asked, 1 if alike else asked.optimiser.geometric.evaluations)
    scene = design_scene(posed, args.problem.parent)
    plan = make_plan(scene, threads=args.threads)
    LOG.info("%s", plan.describe())
    start = None if np.isnan(distance) else closest_vector(scene, design)
    result = optimise(posed, scene, plan, METHOD, args.problem, args.out.parent, start)
    LOG.info("stopped: %s", result.reason)
    made = join({METHOD: design_dataset(posed, scene, result)}, METHOD)
    parents = {"design": args.design, "response": args.response}
    origin = provenance.of_study(asked, "redesign", parents=parents, plan=plan.record())
    datasets.write(made, args.out, "design", origin)


def with_distance_contact(asked: Problem, evaluations: int) -> Problem:
    """Sets contact on distance and the budget in a problem."""
    methods = Methods(sqp=Method(evaluations=evaluations))
    return law_comparison.under(asked, "geometric").with_optimiser(methods=methods)
