"""Decides what a scene needs and what it may skip: once, printed, and stored with results."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from sim.core import Floats, Ints
from sim.quasistatics import StaticSolver
from sim.scene.equal_cases import equal_cases
from sim.scene.scene import Accuracy, Scene
from sim.scene.soundness import check_scene
from sim.solvers import Solver, check_free_dofs, concrete
from sim.structure import ConcreteParameters, parameters, shape
from sim.time_integration import BLANES_MOAN, ExplicitSolver, ImplicitSolver, adapted, time_grid
from sim.vibration import highest_frequency, lowest_frequency

TURN_ALLOWANCE = np.deg2rad(30.0)
"""Relative rotation that a ligament's units may make before its contact is no longer skipped."""

SLOW = 0.75
"""Drives below this fraction of the lowest eigenfrequency excite no waves worth resolving."""

STABLE_FRACTION = {"draft": 0.95, "default": 0.95, "tight": 0.9}
STIFFENING = 1.7
"""Highest eigenfrequency in motion over that at rest (4.6 -> 7 kHz for the paper's lattices)."""


@dataclass(frozen=True)
class GridRule:
    """Holds how the implicit grid is made.

    Attributes:
        first: first step of a graded grid, s.
        growth: of its steps.
        per_period: its longest steps, as parts of the drive's period.
        per_step: error allowed in each step of an adapted grid, mm.
        newton: tolerance of the stage velocities, mm/s.
    """

    first: float
    growth: float
    per_period: int
    per_step: float
    newton: float


GRIDS: dict[Accuracy, GridRule] = {
    "draft": GridRule(1e-3, 1.3, 16, 1e-2, 1e-2),
    "default": GridRule(5e-4, 1.2, 20, 1e-3, 5e-3),
    "tight": GridRule(1e-4, 1.05, 80, 1e-5, 1e-5),
}


@dataclass(frozen=True, eq=False)
class Plan:
    """Holds the decisions for one scene.

    Attributes:
        integrator: how the response is computed.
        solver: ready to use.
        case_of: (n_cases,) the simulated case that each load case takes its loss from.
        decisions: one line for each thing decided.
        skipped: one line for each thing left out.
        warnings: one line for each thing that may not be meant; logged when the plan is made.
        passed: (n_loads,) load parameters, those of the loss among them, by which the paths of a
            static scene are followed anew to confirm losses; None for four for each of these.
    """

    integrator: Literal["static", "implicit", "explicit"]
    solver: Solver
    case_of: Ints
    decisions: tuple[str, ...]
    skipped: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    passed: Floats | None = None

    @property
    def simulated(self) -> Ints:
        """Lists the cases that are simulated, ascending."""
        return np.unique(self.case_of)

    def describe(self) -> str:
        """Says the plan in words, a line a decision."""
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
) -> Plan:
    """Decides how to simulate a scene.

    Args:
        scene: the scene.
        vertices: (n_vertices, 2) the structure, mm; None for a plan that serves an optimisation
            from the initial one.
        times: (n_times,) of the output, s; None for the loss's own samples.
        threads: cases to solve side by side.
        every_case: whether the motion of each load case is wanted, and not its loss alone.

    Raises:
        SimulationError: nothing can move, or nothing acts on what does.
        SceneError: the scene has no meaning.
    """
    structure = scene.lattice.vertices if vertices is None else vertices
    times = sample_times(scene) if times is None else times
    warnings = check_scene(scene, structure, times)
    check_free_dofs(scene.topology)
    values = concrete_parameters(scene, structure)
    decisions: list[str] = []
    skipped = [_reference_line(scene)]

    symmetric = scene.design.symmetry == "C4" and scene.design.copies is None
    may_repeat = not every_case and (vertices is not None or symmetric)
    every = np.arange(len(scene.loads.cases))
    case_of = equal_cases(scene, structure, values) if may_repeat else every
    if copies := int((case_of != every).sum()):
        skipped.append(f"{copies} of {len(every)} load cases: copies turned by 90 deg")
    n_designed, n_ligaments = len(scene.topology.designed), scene.lattice.n_ligaments
    if vertices is not None:
        skipped.append("parameter derivatives: none are asked for")
    elif n_designed < n_ligaments:
        skipped.append(
            f"parameter derivatives of {n_ligaments - n_designed} of {n_ligaments} ligaments: the"
            " design does not move them"
        )
    solver: Solver
    if scene.loads.static:
        integrator: Literal["static", "implicit", "explicit"] = "static"
        solver = StaticSolver(scene.topology, times, threads=threads)
        decisions.append(f"tangent: {scene.topology.numbering[1].describe()}")
        skipped.append("inertia and damping: the scene is static")
    else:
        integrator = _choose(scene, values, decisions)
        end = float(times[-1])
        if integrator == "implicit":
            implicit = _implicit(scene, values, end, times, threads)
            kind = "adapted" if scene.loads.drive_frequency is None else "graded"
            n_steps = len(implicit.times) - 1
            decisions.append(f"grid: {n_steps} {kind} steps over {end:.6g} s, frozen")
            skipped.append(_contact_line(values, implicit))
            solver = implicit
        else:
            explicit = _explicit(scene, values, end, times, threads)
            decisions.append(f"grid: {explicit.n_steps} equal steps over {end:.6g} s")
            if vertices is None:
                megabytes = explicit.adjoint_memory() / 1e6
                decisions.append(f"adjoint: checkpoints, {megabytes:.0f} MB a case")
            solver = explicit
    decisions.insert(0, f"integrator: {integrator}")
    return Plan(integrator, solver, case_of, tuple(decisions), tuple(skipped), warnings)


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


def concrete_parameters(scene: Scene, vertices: Floats) -> ConcreteParameters:
    """Computes the parameters of a structure as NumPy arrays."""
    made = parameters(scene.lattice, shape(scene.lattice, vertices), scene.structure.material)
    return concrete(made)


def _choose(
    scene: Scene, values: ConcreteParameters, decisions: list[str]
) -> Literal["implicit", "explicit"]:
    if scene.numerics.integrator != "auto":
        decisions.append("integrator as asked for")
        return scene.numerics.integrator
    if scene.numerics.accuracy == "tight":
        decisions.append("explicit: a tight tolerance needs every frequency resolved")
        return "explicit"
    if (driven := scene.loads.drive_frequency) is None:
        decisions.append("implicit: the drive has no frequency of its own")
        return "implicit"
    lowest = lowest_frequency(scene.topology, values) / (2 * np.pi)
    slow = driven < SLOW * lowest
    decisions.append(
        f"{'implicit' if slow else 'explicit'}: drive at {driven:.4g} Hz, lowest"
        f" eigenfrequency {lowest:.4g} Hz"
    )
    return "implicit" if slow else "explicit"


def _implicit(
    scene: Scene, values: ConcreteParameters, end: float, times: Floats, threads: int
) -> ImplicitSolver:
    """Solver on a graded grid, or adapted to the hardest case if the drive has no frequency."""
    rule = GRIDS[scene.numerics.accuracy]
    period = end if scene.loads.drive_frequency is None else 1 / scene.loads.drive_frequency
    largest = period / rule.per_period
    steps = time_grid.graded(end, min(rule.first, largest), rule.growth, largest)
    solver = ImplicitSolver(
        scene.topology, steps, times, rule.newton, threads, turn_allowance=TURN_ALLOWANCE
    )
    if scene.loads.drive_frequency is not None:
        return solver
    adapted_to_each = (
        adapted(solver, values, drive, rule.per_step, rule.first, largest)
        for drive in scene.loads.cases
    )
    return max(adapted_to_each, key=lambda made: len(made.times))


def _contact_line(values: ConcreteParameters, solver: ImplicitSolver) -> str:
    n_touching = len(solver.touching(values))
    return (
        f"contact of {len(values.void) - n_touching} of {len(values.void)} ligaments at the start:"
        " their voids are wide open (checked after each solve)"
    )


def _explicit(
    scene: Scene, values: ConcreteParameters, end: float, times: Floats, threads: int
) -> ExplicitSolver:
    highest = STIFFENING * highest_frequency(scene.topology, values)
    largest = (
        STABLE_FRACTION[scene.numerics.accuracy] * BLANES_MOAN.stability / max(highest, 1e-300)
    )
    if (
        scene.loads.drive_frequency is not None
    ):  # a heavy or soft structure is stable with steps far too long
        largest = min(
            largest, 1 / (scene.loads.drive_frequency * GRIDS[scene.numerics.accuracy].per_period)
        )
    return ExplicitSolver(scene.topology, end, int(np.ceil(end / largest)), times, threads)
