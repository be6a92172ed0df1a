"""Imperfect copies of a design: how they are drawn, simulated and measured."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
import xarray as xr

from pipeline.posing.failures import StoppedError
from pipeline.problem.sections import Robustness, Tolerances
from pipeline.runtime import cli
from sim.core import Floats, SimulationError
from sim.energy import observe
from sim.scene import (
    Scene,
    at_rest,
    cases_of,
    drive_force,
    make_plan,
    mimicking,
    sample_times,
    scales,
    target_motion,
)
from sim.solvers import Measure, MotionLaw, Outcome, Solved, Solver, run_batch
from sim.structure import MOST_ROUNDS, Perturbation
from sim.structure import perturbed as perturbed_structure


class Noise(NamedTuple):
    """Names a kind and size of imperfections as the dataset labels it, with what is drawn."""

    name: str
    sizes: Perturbation


class DrawnCopy(NamedTuple):
    """Holds one copy of a structure as it rests, or why there is none."""

    scene: Scene  # with its constants
    vertices: Floats  # (n_vertices, 2) mm
    clashes: int  # units that overlapped, or touched at rest, in the first draw
    redrawn: int  # shifts that were drawn again
    failure: str | None = None


class PerturbedResponse(NamedTuple):
    """Keeps what a copy did under one load case: curves (n_times,) and numbers."""

    rotation: Floats
    departure: Floats
    reaction: Floats
    loss: float
    min_void_angle: float


def noises(asked: Robustness, spacing: float) -> list[Noise]:
    """Lists the imperfections that a problem asks for, of a lattice of some spacing in mm.

    Those that copies have together come alone as well, and then a factor common to all ligaments of
    each of the three stiffnesses.
    """
    found = [
        *(
            Noise(f"geometry {100 * size:g} %", Perturbation(geometry=size * spacing))
            for size in asked.geometry
        ),
        *(
            Noise(f"stiffness {100 * size:g} %", Perturbation(ligaments=size))
            for size in asked.stiffness
        ),
    ]
    if (both := asked.together) is not None:
        length, share = f"{both.geometry:g} mm", f"{100 * both.stiffness:g} %"
        of_both = Perturbation(geometry=both.geometry, ligaments=both.stiffness)
        found.append(Noise(f"together {length}, {share}", of_both))
        found.append(Noise(f"vertices {length}", Perturbation(geometry=both.geometry)))
        if both.stiffness not in asked.stiffness:
            found.append(Noise(f"stiffness {share}", Perturbation(ligaments=both.stiffness)))
        found.append(Noise(f"common {share}", Perturbation(stiffness=both.stiffness)))
    return found


def drawn(
    scene: Scene, vertices: Floats, asked: Tolerances | Perturbation, seed: Sequence[int]
) -> DrawnCopy:
    """Draws one copy of a structure, and lets it come to rest where its ligaments are bent.

    `vertices` (n_vertices, 2) are the design's as it rests, mm; equal seeds give equal copies,
    whatever else is drawn.
    """
    sizes = _sizes(asked, scene.lattice.spacing) if isinstance(asked, Tolerances) else asked
    of = scene.structure
    copy = perturbed_structure(scene.lattice, vertices, of.material, sizes, of.contact, seed)
    made = scene.updated(material=copy.material)
    if sizes.assembly is not None:
        # ligaments join the units where these were put, which breaks a symmetry
        put = replace(scene.lattice, vertices=copy.vertices)
        made = made.updated(lattice=put, symmetry="none")
    found = DrawnCopy(made, copy.vertices, copy.clashes, copy.redrawn)
    if not copy.sound:
        failure = f"units still overlap at rest after {MOST_ROUNDS} draws"
        return found._replace(failure=failure)
    try:
        rest, there = at_rest(made, copy.vertices)
    except SimulationError as error:
        return found._replace(failure=f"the copy does not come to rest: {error}")
    return found._replace(scene=rest, vertices=there)


def _sizes(asked: Tolerances, spacing: float) -> Perturbation:
    return Perturbation(
        asked.geometry * spacing,
        asked.ligaments,
        asked.stiffness,
        asked.units,
        asked.damping,
        (asked.assembly.shift, asked.assembly.turn),
    )


def simulate(
    scene: Scene, vertices: Floats, asked: Robustness, samples: Sequence[int], threads: int
) -> xr.Dataset:
    """The dataset ``scatter`` of some of the copies, by their numbers, of a scene's shipped design.

    `vertices` (n_vertices, 2) are the design's, mm.

    Raises:
        StoppedError: the design itself, or what it is to mimic, cannot be simulated.
    """
    times = sample_times(scene)
    try:
        target = None if scene.objective.reference is None else target_motion(scene, threads)
    except SimulationError as error:
        raise StoppedError(error, scene, "intact", times) from error
    try:
        plan = make_plan(scene, vertices, times, every_case=True, gradient=False)
    except SimulationError as error:
        raise StoppedError(error, scene, "cloaked", times) from error
    parts = []
    listed = noises(asked, scene.lattice.spacing)
    with cli.progress(len(listed) * len(samples), "copies") as bar:
        for number, noise in enumerate(listed):
            seeds = [(asked.seed, number, sample) for sample in samples]
            copies = [drawn(scene, vertices, noise.sizes, seed) for seed in seeds]
            outcomes = _outcomes(scene, plan.solver, copies, target, threads)
            rows = []
            for copy, outcome in zip(copies, outcomes, strict=True):
                rows.append(_row(scene, copy, outcome))
                bar.update(failed=sum(row["status"].item() != "ok" for row in rows))
            part = xr.concat(rows, dim=xr.DataArray(list(samples), dims="sample", name="sample"))
            parts.append(part)
    names = [noise.name for noise in listed]
    return xr.concat(parts, dim=xr.DataArray(names, dims="noise", name="noise"))


def _outcomes(
    scene: Scene,
    solver: Solver,
    copies: Sequence[DrawnCopy],
    target: Floats | None,
    threads: int,
) -> Iterator[list[Outcome[PerturbedResponse]]]:
    """Outcomes of the load cases of every copy; none of a copy that cannot be made."""
    cases = (
        case
        for copy in copies
        if copy.failure is None
        for case in cases_of(copy.scene, copy.vertices, solver)
    )
    n_cases = len(scene.loads.cases)
    done = run_batch(cases, _measure(scene, target), threads)
    for copy in copies:
        yield list(islice(done, n_cases)) if copy.failure is None else []


def _measure(scene: Scene, target: Floats | None) -> Measure[PerturbedResponse]:
    scale = scales(scene.lattice.spacing)

    def reduce(solved: Solved) -> PerturbedResponse:
        case, motion = solved.case, solved.displacement
        aim = None if target is None else target[case.number : case.number + 1]
        inside = motion[:, scene.objective.region]
        apart = (inside if aim is None else inside - aim[0]) / scale
        seen = observe(scene.topology, case.values, motion)
        force = drive_force(scene, case.values, seen, case.drive, sample_times(scene))
        loss = mimicking(scene, aim)(jnp.asarray(motion[None]), case.values)
        return PerturbedResponse(
            np.abs(inside[..., 2]).mean(axis=1),
            np.sqrt((apart**2).sum(axis=-1).mean(axis=-1)),
            force @ _along(scene.loads.motions[case.number]),
            float(loss[0]),
            float(seen.void_angle.min()),
        )

    return reduce


def _along(motion: MotionLaw) -> Floats:
    """Unit vector (2,) of a drive along a straight line; NaN of any other."""
    angle = float(getattr(motion, "direction", np.nan))
    return np.array([np.cos(angle), np.sin(angle)])


def _row(scene: Scene, copy: DrawnCopy, outcomes: list[Outcome[PerturbedResponse]]) -> xr.Dataset:
    """Reduces one copy to the mean of its load cases, or to why there is none.

    How far it is from its target stays that of each: they differ in size.
    """
    every = [copy.failure, *(outcome.failure for outcome in outcomes)]
    failure = next((each for each in every if each is not None), None)
    courses = [outcome.value for outcome in outcomes if outcome.value is not None]
    times = sample_times(scene)

    def mean(name: str) -> Floats:
        values = np.array([getattr(course, name) for course in courses])
        return np.tensordot(scene.loads.case_weights, values, axes=1)

    unknown = np.full((len(scene.loads.cases), len(times)), np.nan)
    curves = {
        name: ("time", unknown[0] if failure else mean(name)) for name in ("rotation", "reaction")
    }
    departure = unknown if failure else np.array([course.departure for course in courses])
    voids = [course.min_void_angle for course in courses]
    numbers = {
        "loss": np.nan if failure else float(mean("loss")),
        "min_void_angle": np.nan if failure else min(voids),
        "clashes": copy.clashes,
        "redrawn": copy.redrawn,
        "status": failure or "ok",
    }
    single = {name: ((), value) for name, value in numbers.items()}
    return xr.Dataset(
        {**curves, "departure": (("case", "time"), departure), **single}, {"time": times}
    )
