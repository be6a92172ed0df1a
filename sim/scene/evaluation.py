"""Evaluates designs: loss and gradient by the adjoint, and the design that minimises the loss."""

import logging
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from functools import lru_cache
from typing import Any, Protocol, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.constraints import ConstraintVector, Limits
from sim.core import Floats, Ints, SimulationError
from sim.optimise import Evaluation, Journal, MmaOptions, Result, SqpOptions
from sim.optimise import minimise as minimise_loss
from sim.quasistatics import StaticRecord, StaticSolver
from sim.scene.objectives import combined
from sim.scene.parameter_map import ParameterMap, parameters_of_copies, parameters_of_design
from sim.scene.path_constraints import PathConstraints, check_unsnapped
from sim.scene.plan import Plan, make_plan, sample_times
from sim.scene.scene import Scene
from sim.scene.simulation import mimicking
from sim.scene.time_solver import RULES, with_halved_steps
from sim.scene.warm_starts import Paths
from sim.solvers import (
    PrescribedMotion,
    Solver,
    adjoint_cases,
    concrete,
    solve_cases,
    with_full_adjoint,
)
from sim.structure import Parameters

LOG = logging.getLogger(__name__)


class Memory(Protocol):
    """Stores the equilibrium paths of designs, to warm-start similar ones."""

    def start(self) -> Sequence[StaticRecord] | None:
        """Records (n_cases,) to start the next evaluation from, if any."""
        ...

    def keep(self, design: Floats, records: Sequence[StaticRecord]) -> None:
        """Stores the records of an evaluation."""
        ...


class GradientChain:
    """Computes a value of simulated motions and its gradient: design, parameters, motion, value.

    The same as ``jax.value_and_grad`` through ``differentiable_motion``, but compiled once.
    `measure` gives value and further numbers of displacements (n_cases, n_times, n_units, 3),
    parameters, and what a call passes besides. `designed` tells whether ``of_design`` is that of a
    scene: what its adjoint need not compute is then skipped.
    """

    def __init__(
        self,
        of_design: ParameterMap,
        measure: Callable[..., tuple[Array, Any]],
        *,
        designed: bool = False,
    ) -> None:
        self._designed = designed
        self.of_design = of_design
        self._measured = jax.jit(jax.value_and_grad(measure, argnums=(0, 1), has_aux=True))

    def with_map(self, of_design: ParameterMap) -> Self:
        """Returns the chain behind another map, its measure compiled no second time."""
        other = copy(self)
        other.of_design = of_design
        return other

    def __call__(
        self,
        design: Floats,
        *passed: Any,  # noqa: ANN401  (what the measure takes)
        solver: Solver,
        cases: Sequence[PrescribedMotion],
        memory: Memory | None = None,
    ) -> tuple[float, Floats, Floats]:
        """Computes value, gradient (n_variables,) and further numbers of a design (n_variables,).

        Raises:
            SimulationError: a step failed, or an equilibrium is not stable.
        """
        made = self.of_design(design)
        solver = solver if self._designed else with_full_adjoint(solver)
        motion, velocity, records = solve_cases(
            solver, concrete(made), cases, _warm_started(solver, memory)
        )
        if memory is not None and isinstance(solver, StaticSolver):
            memory.keep(design, records.records)
        (value, more), (bar_motion, direct) = self._measured(motion, made, *passed)
        still = np.zeros_like(velocity)
        through = adjoint_cases(solver, records, _slopes(bar_motion), still).parameters
        # added by NumPy: JAX would compile a sum for each shape
        bar = Parameters(*(_slopes(a) + b for a, b in zip(direct, through, strict=True)))
        return float(value), self.of_design.pull_back(design, bar), np.asarray(more)


def _slopes(computed: Array) -> Floats:
    """Replaces slopes that are no number by zero: a root has none at zero."""
    slopes = np.asarray(computed)
    return np.where(np.isnan(slopes), 0.0, slopes)


def _warm_started(solver: Solver, memory: Memory | None) -> list[Solver] | None:
    if memory is None or not isinstance(solver, StaticSolver):
        return None
    records = memory.start()
    return None if records is None else [replace(solver, start=record) for record in records]


class Evaluator:
    """Computes loss, gradient and losses of the designs of a scene; compiled once.

    Args:
        scene: the scene.
        plan: of `make_plan`; by default one from the initial structure.
        memory: of equilibrium paths, that those of a static scene start from.
        at: where in the plan's output the samples of the loss are, if there are others.

    Raises:
        ValueError: the scene has nothing to redesign, or no region of interest.
    """

    def __init__(
        self,
        scene: Scene,
        plan: Plan | None = None,
        memory: Memory | None = None,
        at: Ints | slice = slice(None),
    ) -> None:
        self.scene, self.plan = scene, plan or make_plan(scene)
        if scene.space.n_variables == 0:
            raise ValueError("the design of the scene has no cloak that could change")
        simulated = self.plan.simulated
        place = np.searchsorted(simulated, self.plan.case_of)
        weights, measure = jnp.asarray(scene.loads.case_weights), mimicking(scene)

        def mean(displacement: Array, values: Parameters[Array]) -> tuple[Array, Array]:
            each = measure(displacement[:, at], values)[place]
            return combined(each, weights, scene.objective.sharpness), each

        self._cases = tuple(scene.loads.cases[case] for case in simulated)
        self._memory = memory
        chain = GradientChain(parameters_of_design(scene), mean, designed=True)
        self._chains = [chain.with_map(each) for each in parameters_of_copies(scene)]

    def __call__(self, design: Floats) -> tuple[float, Floats, Floats]:
        """Computes loss, gradient (n_variables,) in 1/mm and losses (n_cases,) of a design, mm.

        Raises:
            SimulationError: the simulation fails.
        """
        solver, cases = self.plan.solver, self._cases
        if self.scene.design.copies is None:
            return self._chains[0](design, solver=solver, cases=cases, memory=self._memory)
        memory = None
        if self._memory is not None and isinstance(solver, StaticSolver):
            memory = _CopyMemory(self._memory, len(cases))
        found = [chain(design, solver=solver, cases=cases, memory=memory) for chain in self._chains]
        if memory is not None:
            memory.finish(design)
        values, gradients, each = (np.array(part) for part in zip(*found, strict=True))
        # (sum v^p / n)^(1/p) of the copies' losses v, and its derivatives (v / value)^(p - 1) / n
        sharpness = self.scene.objective.copy_sharpness
        value = float(combined(values, np.full(len(values), 1 / len(values)), sharpness))
        shares = (values / (value or 1.0)) ** (sharpness - 1.0) / len(values)
        return value, shares @ gradients, each.mean(axis=0)


class _CopyMemory:
    """Splits the stored paths of a design by its copies (``Memory``), one after the other."""

    def __init__(self, every_copy: Memory, n_cases: int) -> None:
        self._every_copy, self._n_cases = every_copy, n_cases
        self._before, self._after = every_copy.start(), list[StaticRecord]()

    def start(self) -> Sequence[StaticRecord] | None:
        """See ``Memory``."""
        first = len(self._after)
        return self._before and self._before[first : first + self._n_cases]

    def keep(self, design: Floats, records: Sequence[StaticRecord]) -> None:
        """See ``Memory``."""
        del design
        self._after += records

    def finish(self, design: Floats) -> None:
        """Stores the records of all copies."""
        self._every_copy.keep(design, self._after)


_evaluator = lru_cache(maxsize=4)(Evaluator)


def evaluate(
    scene: Scene, design: Floats | None = None, plan: Plan | None = None
) -> tuple[float, Floats]:
    """Computes the loss of a design and its gradient, by the adjoint of the steps taken.

    It is plain NumPy, without transforms of JAX; a loss of one's own is differentiated through
    `simulate`. What is compiled for a scene is kept.

    Args:
        scene: the scene, with an objective and a design.
        design: (n_variables,) design vector, mm; by default the initial structure.
        plan: of `make_plan`; by default one from the initial structure.

    Returns:
        the loss, and its gradient (n_variables,) per mm.

    Raises:
        SimulationError: the simulation fails.
        ValueError: the scene has nothing to redesign, or no region of interest.
    """
    chosen = np.zeros(scene.space.n_variables) if design is None else design
    loss, gradient, _ = _evaluator(scene, plan)(chosen)
    return loss, gradient


def minimise(
    scene: Scene,
    limits: Limits,
    start: Floats | None = None,
    *,
    options: SqpOptions | MmaOptions | None = None,
    plan: Plan | None = None,
    journal: Journal | None = None,
    paths: Paths | None = None,
    callback: Callable[[Evaluation], None] | None = None,
) -> Result:
    """Minimises the loss of a scene over the designs that can be made.

    Args:
        scene: the scene, with an objective and a design.
        limits: what a design must keep to.
        start: (n_variables,) design vector, mm; by default the initial structure. One that snaps
            where it is not to is drawn back towards that.
        options: of the method, which they choose; by default SQP with its own.
        plan: of `make_plan`; by default one from the initial structure.
        journal: of evaluations, from which an interrupted run resumes exactly. It tells scenes
            apart by its key alone, which is to name all that the loss depends on. It holds
            constraints under loads as well, of a snap margin or foil.
        paths: of equilibria, that evaluations of a static scene start from.
        callback: called with each evaluation as it is recorded.

    Raises:
        InfeasibleStartError: no feasible design near the start.
        SimulationError: the start cannot be simulated.
        UnconfirmedError: no design is confirmed by a path through more loads.
    """
    made = plan or make_plan(scene)
    computed = Evaluator(scene, made, paths)
    constraints = constraints_of(scene, made, limits, journal)
    begin = np.zeros(scene.space.n_variables) if start is None else start
    if isinstance(constraints, PathConstraints):
        begin = constraints.recover_start(begin)

    def record(evaluation: Evaluation) -> None:
        if paths is not None:
            paths.accept(evaluation)
        if callback is not None:
            callback(evaluation)

    result = minimise_loss(
        "mma" if isinstance(options, MmaOptions) else "sqp",
        computed if journal is None else journal.wrap(computed),
        constraints,
        begin,
        options=options,
        callback=record,
        confirm=_confirmation(scene, made),
    )
    _check_time_steps(computed, result)
    return result


def _check_time_steps(evaluate: Evaluator, result: Result) -> None:
    """Warns if the loss at the start or the end changes with half the steps by more than allowed.

    The steps were chosen for the initial structure and kept. What is allowed is that share of the
    loss at the start.
    """
    solver: Any = evaluate.plan.solver
    if isinstance(solver, StaticSolver):
        return
    first = result.evaluations[0]
    finer = copy(evaluate)
    finer.plan = replace(evaluate.plan, solver=with_halved_steps(solver))
    allowed = RULES[evaluate.scene.numerics.accuracy].loss
    for name, design, loss in (("start", first.x, first.loss), ("end", result.x, result.loss)):
        try:
            change = abs(finer(design)[0] - loss) / abs(first.loss)
        except SimulationError as failure:
            LOG.warning("half the steps fail at the %s: %s", name, failure)
            continue
        LOG.info("half the steps change the loss at the %s by %.2g of the first", name, change)
        if change > allowed:
            LOG.warning(
                "half the steps change the loss at the %s by %.2g of the first, the accuracy asked"
                " for allows %g; ask for solver.accuracy: tight",
                name,
                change,
                allowed,
            )


def constraints_of(
    scene: Scene, plan: Plan, limits: Limits, journal: Journal | None = None
) -> ConstraintVector | PathConstraints:
    """Makes the constraints of a design; a journal holds those under loads."""
    geometry, asked = ConstraintVector(scene.space, limits), scene.objective
    at_rest = asked.snap_margin is None and asked.foil is None
    return geometry if at_rest else PathConstraints(scene, plan, geometry, journal)


def _confirmation(scene: Scene, plan: Plan) -> Evaluator | None:
    """Evaluates by a path followed anew, over the loads of the plan; None of a motion in time.

    A path that starts from that of a similar design may pass where it should end. Where the design
    is to avoid snaps, one of the perfect structure on that path is an error.
    """
    if not isinstance(plan.solver, StaticSolver):
        return None
    made = replace(plan, solver=plan.confirming)
    memory = None if scene.objective.snap_margin is None else _SnapCheck(scene, made)
    at = np.searchsorted(made.solver.output_times, sample_times(scene) * (1 - 1e-9))
    return Evaluator(scene, made, memory, at=at)


class _SnapCheck:
    """Rejects designs whose structure snaps; stores nothing (``Memory``).

    As the constraint does, it looks at the perfect structure: copies count by their losses alone.
    """

    def __init__(self, scene: Scene, plan: Plan) -> None:
        self._scene, self._plan = scene, plan

    def start(self) -> None:
        """See ``Memory``."""

    def keep(self, design: Floats, records: Sequence[StaticRecord]) -> None:
        """Raises SimulationError where the structure snaps."""
        if self._scene.design.copies is not None:
            snapping = sum(bool(record.jumped.any()) for record in records)
            LOG.info("%d of %d paths of imperfect copies snap", snapping, len(records))
            records = self._perfect(design)
        for record in records:
            check_unsnapped(record, self._scene.loads.duration)

    def _perfect(self, design: Floats) -> Sequence[StaticRecord]:
        """Follows the perfect structure of a design under all cases."""
        values = concrete(parameters_of_design(self._scene)(design))
        cases = [self._scene.loads.cases[case] for case in self._plan.simulated]
        _, _, records = solve_cases(self._plan.solver, values, cases)
        return records.records
