"""Decides what a scene needs and what it may skip: once, printed, and stored with results."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from sim.core import Floats, Ints
from sim.linalg import FASTEST
from sim.quasistatics import StaticSolver
from sim.scene.equal_cases import equal_cases
from sim.scene.parameter_map import concrete_parameters
from sim.scene.scene import Scene
from sim.scene.time_solver import time_solver
from sim.scene.validation import check_scene
from sim.solvers import Solver, check_free_dofs
from sim.structure import ConcreteParameters
from sim.time_integration import ExplicitSolver, ImplicitSolver

Integrator: TypeAlias = Literal["static", "implicit", "explicit"]

CONFIRMING = 4
"""Loads passed for each of the loss where its loads alone are known."""


@dataclass(frozen=True, eq=False)
class Plan:
    """Holds the decisions for one scene."""

    integrator: Integrator  # how the response is computed
    solver: Solver  # ready to use
    case_of: Ints  # (n_cases,) the simulated case that each load case takes its loss from
    decisions: tuple[str, ...]  # one line for each thing decided
    skipped: tuple[str, ...]  # one line for each thing left out
    warnings: tuple[str, ...] = ()  # what may not be meant, a line each; logged
    # (n_loads,) load parameters, those of the loss among them, that paths of a static scene pass
    # where losses are confirmed and snaps avoided; None for four for each of these
    passed: Floats | None = None

    @property
    def simulated(self) -> Ints:
        """Lists the cases that are simulated, ascending."""
        return np.unique(self.case_of)

    @property
    def confirming(self) -> StaticSolver:
        """Follows the paths of a static scene through all loads that confirm a loss."""
        assert isinstance(self.solver, StaticSolver)
        finer = replace(self.solver, substeps=CONFIRMING)
        loads = finer.passed if self.passed is None else self.passed
        return replace(self.solver, output_times=loads)

    def describe(self) -> str:
        """Describes the plan in words, a line a decision."""
        return "\n".join((*self.decisions, *(f"skipped: {line}" for line in self.skipped)))

    def record(self) -> dict[str, Any]:
        """Returns the plan as plain data, to be stored."""
        return {
            "integrator": self.integrator,
            "decisions": list(self.decisions),
            "skipped": list(self.skipped),
            "warnings": list(self.warnings),
        }


def make_plan(
    scene: Scene,
    vertices: Floats | None = None,
    times: Floats | None = None,
    threads: int = 1,
    every_case: bool = False,
    gradient: bool = True,
) -> Plan:
    """Decides how to simulate a scene.

    Args:
        scene: the scene.
        vertices: (n_vertices, 2) the structure, mm; None for a plan that serves an optimisation
            from the initial one.
        times: (n_times,) of the output, s; None for the loss's own samples.
        threads: cores to use: for cases side by side, and for the tangent of a large lattice.
        every_case: whether the motion of each load case is wanted, and not its loss alone.
        gradient: whether derivatives are wanted; without, stages are solved as motions need it, a
            path goes on where units meet, and its tangent is stored as is fastest.

    Raises:
        SimulationError: nothing can move, or no two units are joined.
        SceneError: the scene has no meaning.
    """
    structure = scene.lattice.vertices if vertices is None else vertices
    times = sample_times(scene) if times is None else times
    warnings = list(check_scene(scene, structure, times))
    check_free_dofs(scene.topology)
    values = concrete_parameters(scene, structure)
    case_of = np.arange(len(scene.loads.cases))
    symmetric = scene.design.symmetry == "C4" and scene.design.copies is None
    if not every_case and (vertices is not None or symmetric):
        case_of = equal_cases(scene, structure, values)
    decisions: list[str] = []
    solver: Solver
    if scene.loads.static:
        top = scene.topology if gradient else replace(scene.topology, storages=FASTEST)
        solver = StaticSolver(top, times, threads=threads, continues=not gradient)
        decisions.append(f"tangent: {top.numbering[1].describe()}")
    else:
        solver = time_solver(scene, values, times, threads, decisions, warnings, gradient)
    if isinstance(solver, ExplicitSolver) and vertices is None:
        megabytes = solver.adjoint_memory() / 1e6
        decisions.append(f"adjoint: checkpoints, {megabytes:.0f} MB a case")
    integrator = _integrator(solver)
    skipped = (
        *([_reference_line(scene)] if vertices is None else []),
        *_repeated_cases(case_of),
        *(_fixed_ligaments(scene) if vertices is None else []),
        *_skipped_by(solver, values, gradient),
    )
    told = (f"integrator: {integrator}", *decisions)
    return Plan(integrator, solver, case_of, told, skipped, tuple(warnings))


def _integrator(solver: Solver) -> Integrator:
    if isinstance(solver, StaticSolver):
        return "static"
    return "implicit" if isinstance(solver, ImplicitSolver) else "explicit"


def _repeated_cases(case_of: Ints) -> Iterator[str]:
    if copies := int((case_of != np.arange(len(case_of))).sum()):
        yield f"{copies} of {len(case_of)} load cases: copies turned by 90 deg"


def _fixed_ligaments(scene: Scene) -> Iterator[str]:
    n_designed, n_ligaments = len(scene.topology.designed), scene.lattice.n_ligaments
    if n_designed < n_ligaments:
        yield (
            f"parameter derivatives of {n_ligaments - n_designed} of {n_ligaments} ligaments: the"
            " design does not move them"
        )


def _skipped_by(solver: Solver, values: ConcreteParameters, gradient: bool) -> Iterator[str]:
    """Lists what the solver of a scene leaves out, a line each."""
    if isinstance(solver, StaticSolver):
        yield "inertia and damping: the scene is static"
    if isinstance(solver, ImplicitSolver):
        yield _contact_line(values, solver)
        if not gradient:
            yield f"accuracy for a gradient: stages to {solver.tolerance:.1g} mm/s"


def _reference_line(scene: Scene) -> str:
    if scene.objective.reference is None:
        return "simulation of the unloaded reference: it is zero"
    return "simulation of the intact reference in every evaluation: once will do"


def sample_times(scene: Scene) -> Floats:
    """Spaces the times (n_times,) of the samples or load steps that the loss is taken at."""
    if scene.objective.steps is not None:
        return (
            scene.loads.duration * np.arange(1, scene.objective.steps + 1) / scene.objective.steps
        )
    return np.linspace(0.0, scene.loads.duration, scene.objective.samples)


def _contact_line(values: ConcreteParameters, solver: ImplicitSolver) -> str:
    n_touching = len(solver.touching(values))
    return (
        f"contact of {len(values.void) - n_touching} of {len(values.void)} ligaments at the start:"
        " their voids are wide open (checked after each solve)"
    )
