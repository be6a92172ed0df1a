"""Simulates a scene: the one way from a structure to its motion, forces and losses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.core import Floats, Ints, Numbers
from sim.energy import Observables, observe
from sim.scene.drive_forces import drive_force
from sim.scene.objectives import (
    DisplacementMimicking,
    ReactionMimicking,
    RelativeMimicking,
    StrainEnergyMimicking,
    combined,
    extent,
)
from sim.scene.parameter_map import concrete_parameters, parameters_of_design
from sim.scene.plan import Plan, make_plan, sample_times
from sim.scene.scene import Scene
from sim.scene.validation import SceneError, check_cases, check_units
from sim.solvers import Case, Solver, concrete, differentiable_motion, solve_cases
from sim.structure import Parameters
from sim.time_integration import simpson_weights

Mimicking = DisplacementMimicking | RelativeMimicking | ReactionMimicking | StrainEnergyMimicking
BALANCED = 1e-9
"""Net force of a drive over the sum of its ligaments' forces, below which it is rounding."""


@dataclass(frozen=True)
class Response:
    """Holds the simulated motion of a structure, and what follows from it.

    Attributes:
        scene: what was simulated.
        plan: how.
        parameters: of the structure.
        cases: (n_cases,) numbers of the load cases that were simulated.
        displacement: (n_cases, n_times, n_units, 3) mm, mm, rad.
        velocity: (n_cases, n_times, n_units, 3) mm/s, mm/s, rad/s.
        solvers, records: of each case; none where the response is differentiated by JAX.
    """

    scene: Scene
    plan: Plan
    parameters: Parameters[Any]
    cases: tuple[int, ...]
    displacement: Any
    velocity: Any
    solvers: tuple[Solver, ...] = ()
    records: tuple[Any, ...] = ()

    @property
    def times(self) -> Floats:
        """(n_times,) s; load parameters of a static scene."""
        return self.plan.solver.output_times

    @cached_property
    def observables(self) -> tuple[Observables, ...]:
        """(n_cases,) energies, reactions and strains of every state."""
        topology = self.scene.topology
        return tuple(observe(topology, self.parameters, motion) for motion in self.displacement)

    @cached_property
    def drive_force(self) -> Floats:
        """(n_cases, n_times, 2) force on a drive's units, N; with inertia but in a `TimeSeries`.

        Its velocity changes at its points alone. Of motions that act together it is the force on
        the first one's units.
        """
        drives = [self.scene.loads.cases[case] for case in self.cases]
        return np.stack(
            [
                drive_force(self.scene, self.parameters, seen, drive, self.times)
                for seen, drive in zip(self.observables, drives, strict=True)
            ]
        )

    @cached_property
    def losses(self) -> Array:
        """(n_cases,) of all load cases; differentiable by JAX.

        Raises:
            ValueError: the times are not those of the scene's loss, or load cases are missing.
        """
        if not np.array_equal(self.times, sample_times(self.scene)):
            raise ValueError("the loss is taken at sample_times(scene): leave the times out")
        place = np.array([self.cases.index(case) for case in self.plan.case_of])
        return mimicking(self.scene)(self.displacement[place], self.parameters)

    @property
    def loss(self) -> Array:
        """Returns what is minimised: the weighted mean of the losses, or their p-mean."""
        scene = self.scene
        return combined(self.losses, scene.loads.case_weights, scene.objective.sharpness)

    def refined(self) -> Response:
        """Simulates again with half the steps, to estimate the error by.

        Raises:
            SimulationError: a step failed.
        """
        pairs = zip(self.solvers, self.records, strict=True)
        return _solved(self, tuple(solver.refined(record) for solver, record in pairs))


def simulate(
    scene: Scene,
    design: Numbers | None = None,
    *,
    vertices: Floats | None = None,
    times: Floats | None = None,
    cases: Iterable[int] | None = None,
    plan: Plan | None = None,
    threads: int | None = None,
) -> Response:
    """Simulates a structure under the load cases of a scene.

    It is differentiable by the ``design``: ``jax.grad`` and ``jax.vjp`` of functions of the
    displacement, the velocity or the losses run the exact adjoint of the steps taken. Under
    ``jax.jit``, ``vmap``, ``jvp``, ``jacrev`` and for second derivatives it raises a TypeError.

    Args:
        scene: the scene.
        design: (n_variables,) design vector, mm; by default the initial structure.
        vertices: (n_vertices, 2) of the structure instead, mm, between which ligaments are those of
            the lattice; others need a scene of ``dataclasses.replace(lattice, vertices=vertices)``.
        times: (n_times,) of the output, s; by default those of the loss.
        cases: numbers of the load cases; by default all, or those of the ``plan``.
        plan: of `make_plan`, to be made once where many designs are simulated alike.
        threads: cores to use, for cases side by side and, where some are left over, for the tangent
            of a large lattice; by default one, or as many as the ``plan`` has.

    Raises:
        ValueError: times are given beside a plan, which has its own.
        SimulationError: a step failed even after it was cut; the error names it.
        SceneError: the scene or its structure has no meaning.
    """
    made = _planned(scene, vertices, times, plan, threads)
    chosen = tuple(int(case) for case in (made.simulated if cases is None else cases))
    check_cases(scene, chosen)
    if vertices is not None or design is None:
        network = scene.lattice.vertices if vertices is None else vertices
        check_units(scene.lattice, network)
        values: Parameters[Any] = concrete_parameters(scene, network)
    else:
        values = parameters_of_design(scene)(jnp.asarray(design))
    if isinstance(values.arm, jax.core.Tracer):
        drives = tuple(scene.loads.cases[case] for case in chosen)
        motion = differentiable_motion(made.solver, values, drives, designed=True)
        return Response(scene, made, values, chosen, *motion)
    if vertices is None and design is not None:
        check_units(scene.lattice, np.asarray(scene.space.vertices(design)))
    empty = Response(scene, made, concrete(values), chosen, np.empty(0), np.empty(0))
    return _solved(empty, (made.solver,) * len(chosen))


def _planned(
    scene: Scene,
    vertices: Floats | None,
    times: Floats | None,
    plan: Plan | None,
    threads: int | None,
) -> Plan:
    """Makes a plan, or lets a given one have the threads that are asked for."""
    if plan is None:
        return make_plan(scene, vertices, times, threads or 1, every_case=True)
    if times is not None:
        raise ValueError("a plan has its own times: give make_plan the times, or leave one out")
    solver: Any = plan.solver
    if threads in (None, solver.threads):
        return plan
    return replace(plan, solver=replace(solver, threads=threads))


def _solved(response: Response, solvers: tuple[Solver, ...]) -> Response:
    drives = [response.scene.loads.cases[case] for case in response.cases]
    solver = response.plan.solver
    displacement, velocity, made = solve_cases(solver, response.parameters, drives, solvers)
    return replace(
        response,
        displacement=displacement,
        velocity=velocity,
        solvers=solvers,
        records=tuple(made.records),
    )


def cases_of(
    scene: Scene, vertices: Floats, solver: Solver, numbers: Iterable[int] | None = None
) -> Iterator[Case]:
    """Lists the load cases of a structure for `run_batch`; all, or those of the ``numbers``."""
    values, drives = concrete_parameters(scene, vertices), scene.loads.cases
    chosen = range(len(drives)) if numbers is None else numbers
    return (Case(values, drives[number], solver, int(number)) for number in chosen)


def mimicking(
    scene: Scene, target: Numbers | None = None, weights: Floats | None = None
) -> Mimicking:
    """Builds the loss of a scene, as of its `Objective`: of the motion and the parameters.

    `target` (n_cases, n_times, n_region, 3) is what ``target_motion`` returned, simulated anew if a
    scene with a reference comes without; `weights` (n_times,) are of other samples than the scene's
    own, without the drive's force.

    Raises:
        ValueError: the scene has no region of interest.
        SceneError: the force of a drive is to be mimicked, and vanishes.
    """
    lattice, asked = scene.lattice, scene.objective
    given = _weights(scene) if weights is None else weights
    if len(asked.region) == 0:
        raise ValueError("the objective of the scene has no region of interest")
    if asked.kind == "strain_energy":
        ligaments = scene.region_ligaments
        return StrainEnergyMimicking(ligaments, lattice.ligament_units[ligaments], given)
    if asked.reference is None:
        return DisplacementMimicking(asked.region, lattice.spacing, given)
    aim = target_motion(scene) if target is None else target
    size = extent(aim, lattice.spacing)
    whole = size.max(axis=1) if asked.steps is None else size[:, -1] / np.sqrt(asked.steps)
    motion = RelativeMimicking(asked.region, lattice.spacing, given, aim, whole)
    return _with_reaction(scene, motion) if asked.reaction else motion


def _with_reaction(scene: Scene, motion: RelativeMimicking) -> ReactionMimicking:
    """Adds the force of the drive to a motion to mimic; simulates the reference for it.

    Raises:
        SceneError: the forces of a drive balance in the reference, so it has none to mimic.
    """
    intact, asked = scene.objective.reference, scene.objective
    assert intact is not None
    of_intact = ReactionMimicking(motion, 1.0, *_cut_ligaments(intact), np.zeros(2), np.ones(1))
    moved = simulate(intact, vertices=intact.lattice.vertices)
    target = np.asarray(of_intact.force(moved.displacement, moved.parameters))
    carried = np.asarray(of_intact.carried(moved.displacement, moved.parameters))
    size = np.linalg.norm(target, axis=2)
    net, every = (
        each.max(axis=1) if asked.steps is None else each[:, -1] for each in (size, carried)
    )
    for case in np.flatnonzero(~(net > BALANCED * every)):
        raise SceneError(
            f"the forces of load case {case} on the units that it drives balance in the reference"
            f" ({net[case]:.2g} N of {every[case]:.2g} N), so there is none to mimic; leave the"
            " reaction out, or drive one side",
            "objective.reaction",
        )
    whole = net if asked.steps is None else net / np.sqrt(asked.steps)
    return ReactionMimicking(motion, asked.reaction, *_cut_ligaments(scene), target, whole)


def _cut_ligaments(scene: Scene) -> tuple[Ints, Ints, Ints]:
    """Finds the ligaments that any drive's units are cut off by, their units, and signs."""
    ends = scene.lattice.ligament_units
    driven = np.array([np.isin(ends, case.leading) for case in scene.loads.cases]).astype(np.int64)
    sign = driven[..., 0] - driven[..., 1]
    cut = np.flatnonzero(sign.any(axis=0))
    return cut, ends[cut], sign[:, cut]


def _weights(scene: Scene) -> Floats:
    asked = scene.objective
    if asked.steps is None:
        return simpson_weights(asked.samples, 1.0)
    return np.full(asked.steps, 1 / asked.steps)


def target_motion(scene: Scene, threads: int = 1) -> Floats:
    """Simulates the region of the reference: motion (n_cases, n_times, n_region, 3) at the samples.

    Raises:
        SimulationError: the reference cannot be simulated.
    """
    reference = scene.objective.reference
    if reference is None:
        raise ValueError("the scene has no reference: it is compared with rest")
    response = simulate(reference, vertices=reference.lattice.vertices, threads=threads)
    return np.asarray(response.displacement[:, :, reference.objective.region])
