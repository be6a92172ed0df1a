"""Chooses integrator and steps of a motion in time, by estimates of the error that they make.

A first grid is solved beside one of half its steps. The difference over ``ratio^order - 1``
estimates the error of the finer one, and steps are cut until it is what the accuracy allows. The
order is that of motions which start with a jump of the velocity, well below that of the method.
Explicit steps, which cannot be longer than stable ones, are compared with the leapfrog's first.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, TypeVar
from warnings import catch_warnings, simplefilter

import numpy as np
import scipy.sparse.linalg as spla

from sim.core import Floats, SimulationError
from sim.linalg import FASTEST
from sim.scene.scene import DIRECTED, Accuracy, Scene
from sim.solvers import (
    PrescribedMotion,
    Pulse,
    breakpoints,
    check_masses,
    single_motions,
    solve_case,
)
from sim.structure import ConcreteParameters
from sim.time_integration import (
    BLANES_MOAN,
    LEAPFROG,
    ExplicitSolver,
    ImplicitSolver,
    adapted,
    time_grid,
)
from sim.vibration import highest_frequency, linearised, lowest_frequency

LOG = logging.getLogger(__name__)

TURN_ALLOWANCE = np.deg2rad(30.0)
"""Relative rotation that a ligament's units may make before its contact is no longer skipped."""

SLOW_DRIVE = 0.75
"""Drives below this fraction of the lowest eigenfrequency may excite no waves worth resolving."""

STABLE_FRACTION = {"draft": 0.95, "default": 0.95, "tight": 0.9}
STIFFENING = 1.7
"""Highest eigenfrequency in motion over that at rest (4.6 -> 7 kHz for the paper's lattices)."""

NEWTON = 1e-6
"""Tolerance of the stage velocities, mm/s: losses are smooth to 1e-13, gradients exact to 1e-6."""
STAGE_SHARE = 0.1
"""That of a motion without a gradient, over the drive's size and frequency times the error that the
accuracy allows a motion: it makes a hundredth of that error, and takes half as many iterations."""
IMPLICIT_ORDER, EXPLICIT_ORDER = 0.6, 3.0
MOST_PARTS = 8
EXPLICIT_STEPS = 6
"""Explicit steps that an implicit one must save to be taken: it takes the time of four, the adjoint
of either counted in, and they resolve the front of a jump as well."""
MOST_DOUBLINGS = 4
MOST_MEMORY = 1 << 29
"""Bytes that the stages of an implicit run may take."""
SAMPLES = 1001
"""Times at which the size of a drive is looked for."""


@dataclass(frozen=True)
class StepRule:
    """Holds the first grid of an accuracy, and the errors that it allows."""

    first: float  # first step of a graded grid, s
    growth: float  # of its steps
    per_period: int  # its longest steps, as parts of the drive's period
    per_step: float  # error allowed in each step of an adapted grid, over the size of the drive
    loss: float  # error allowed in the mean square of the region's motion, relative
    motion: float  # in its motion, root mean square, relative


RULES: dict[Accuracy, StepRule] = {
    "draft": StepRule(1e-3, 1.3, 16, 1e-2, 1e-2, 5e-2),
    "default": StepRule(7e-4, 1.3, 20, 3e-3, 1e-3, 1e-2),
    "tight": StepRule(1e-4, 1.05, 80, 3e-4, 1e-6, 1e-4),
}

TimeSolver = ImplicitSolver | ExplicitSolver
S = TypeVar("S", ImplicitSolver, ExplicitSolver)


def time_solver(
    scene: Scene,
    values: ConcreteParameters,
    times: Floats,
    threads: int,
    decisions: list[str],
    warnings: list[str],
    gradient: bool,
) -> TimeSolver:
    """Chooses the solver of a motion for a structure, with the output at `times` (n_times,), s.

    Without a `gradient` to be asked for, implicit stages are solved as motions need it. What was
    decided is appended to `decisions`, a line each, and to `warnings` if the accuracy is
    not reached.

    Raises:
        SimulationError: a unit has no mass.
    """
    error = _ErrorEstimate(scene, values, float(times[-1]))
    explicit = _explicit(scene, values, times, threads)
    if _tries_implicit(scene, values, decisions):
        auto = scene.numerics.integrator == "auto"
        stored = 3 * 4 * scene.topology.n_dofs * np.dtype(float).itemsize
        most = explicit.n_steps // EXPLICIT_STEPS if auto else MOST_MEMORY // stored
        try:
            first = _first_grid(scene, values, times, threads, most)
            solver, left = _refine(first, None, _divide_steps, IMPLICIT_ORDER, error, most)
        except SimulationError:
            if not auto:
                raise
            left = np.inf
        if left <= 1.0 or not auto:
            kind = "adapted" if scene.loads.drive_frequency is None else "graded"
            report = f"grid: {len(solver.times) - 1} {kind} steps over {times[-1]:.6g} s, frozen"
            decisions.extend([report, error.report(left, warnings)])
            return solver if gradient else replace(solver, tolerance=error.tolerance)
        decisions.append("explicit: implicit steps as short as the accuracy asks for take longer")
    rough = replace(explicit, splitting=LEAPFROG, n_steps=_equivalent_steps(explicit.n_steps))
    most = 2**MOST_DOUBLINGS * explicit.n_steps
    chosen, left = _refine(rough, explicit, _double_steps, EXPLICIT_ORDER, error, most)
    report = f"grid: {chosen.n_steps} equal steps over {times[-1]:.6g} s"
    decisions.extend([report, error.report(left, warnings)])
    return chosen


def expected_steps(
    scene: Scene, values: ConcreteParameters, times: Floats
) -> tuple[Literal["implicit", "explicit"], int]:
    """Guesses integrator and number of steps of a motion, without solving for any."""
    explicit, asked = _explicit(scene, values, times, 1).n_steps, scene.numerics.integrator
    # nearer to resonance implicit steps are cut too often
    if _tries_implicit(scene, values, [], SLOW_DRIVE / 2):
        implicit = len(_graded(scene, float(times[-1]))[0]) - 1
        if asked != "auto" or implicit * EXPLICIT_STEPS <= explicit:
            return "implicit", implicit
    return "explicit", explicit


def _equivalent_steps(n_steps: int) -> int:
    """Counts the leapfrog's steps at the same share of its stability limit."""
    return int(np.ceil(n_steps * BLANES_MOAN.stability / LEAPFROG.stability))


def _tries_implicit(
    scene: Scene, values: ConcreteParameters, decisions: list[str], slow: float = SLOW_DRIVE
) -> bool:
    """Decides whether an implicit grid is tried, and appends the reason."""
    if scene.numerics.integrator != "auto":
        decisions.append("integrator as asked for")
        return scene.numerics.integrator == "implicit"
    if scene.numerics.accuracy == "tight":
        decisions.append("explicit: a tight tolerance needs every frequency resolved")
        return False
    every = [one for motion in scene.loads.motions for one in single_motions(motion)]
    bells = [0.5 / float(one.width) for one in every if isinstance(one, Pulse)]
    driven = scene.loads.drive_frequency or max(bells, default=None)
    if driven is None:
        decisions.append("the drive has no frequency of its own")
        return True
    lowest = lowest_frequency(scene.topology, values) / (2 * np.pi)
    decisions.append(f"drive at {driven:.4g} Hz, lowest eigenfrequency {lowest:.4g} Hz")
    return driven < slow * lowest


class _ErrorEstimate:
    """Compares solutions of all different drives with what the accuracy allows."""

    def __init__(self, scene: Scene, values: ConcreteParameters, end: float) -> None:
        self._scene, self._values, self._end = scene, values, end
        self._drives = distinct_drives(scene)
        self._rule, self._accuracy = RULES[scene.numerics.accuracy], scene.numerics.accuracy
        region, every = scene.objective.region, np.arange(scene.lattice.n_units)
        self._units = region if len(region) else np.setdiff1d(every, scene.loads.driven)
        self._scales = np.array([scene.lattice.spacing, scene.lattice.spacing, 1.0])

    @cached_property
    def tolerance(self) -> float:
        """Bounds the error of stage velocities by what a motion itself needs, mm/s."""
        scene, stops = self._scene, _breakpoints(self._drives, self._end)
        rate = scene.loads.drive_frequency or 1.0 / self._end
        sizes = [_size(scene, self._end, self._values, each, stops) for each in self._drives]
        return max(NEWTON, STAGE_SHARE * self._rule.motion * min(sizes) * rate)

    def motions(self, solver: S) -> tuple[list[Floats] | None, S]:
        """Solves for the region's motions (n_times, n_region, 3); None if that fails.

        Also returns the solver with the steps that had to be cut on the way.
        """
        loose: TimeSolver = solver
        if isinstance(solver, ImplicitSolver):
            loose = replace(solver, tolerance=self.tolerance)
        try:
            solved = [solve_case(loose, self._values, drive) for drive in self._drives]
        except SimulationError:
            return None, solver
        moved = [u.reshape(len(u), -1, 3)[:, self._units] / self._scales for u, _, _ in solved]
        if isinstance(solver, ImplicitSolver):
            longest = max((record.times for _, _, record in solved), key=len)
            return moved, replace(solver, times=longest)
        return moved, solver

    def relative_difference(self, one: list[Floats] | None, other: list[Floats] | None) -> float:
        """Returns the greatest difference of two solutions, over what is allowed."""
        if one is None or other is None:
            return np.inf
        return max(self._difference(*pair) for pair in zip(one, other, strict=True))

    def _difference(self, one: Floats, other: Floats) -> float:
        size = float(np.sum(other**2))
        if size == 0.0:
            return np.inf if one.any() else 0.0
        loss = abs(float(np.sum(one**2)) - size) / size
        motion = float(np.sqrt(np.sum((one - other) ** 2) / size))
        return max(loss / self._rule.loss, motion / self._rule.motion)

    def report(self, left: float, warnings: list[str]) -> str:
        """Reports the estimated error over the allowed one."""
        allowed = f"loss {self._rule.loss:g}, motion {self._rule.motion:g}"
        line = f"estimate: {left:.2g} of the error that {self._accuracy} allows ({allowed})"
        if left > 1.0:
            warnings.append(f"{line}, with the shortest steps that were tried")
            LOG.warning(warnings[-1])
        return line


def distinct_drives(scene: Scene) -> list[PrescribedMotion]:
    """Lists the drives of the load cases; the first of those that differ by direction alone."""
    found: dict[object, PrescribedMotion] = {}
    for drive in scene.loads.cases:
        motion = drive.motion
        undirected = _undirected_numbers(motion) if isinstance(motion, DIRECTED) else id(motion)
        control = None if drive.control is None else drive.control.tobytes()
        found.setdefault((type(motion), tuple(drive.units), control, undirected), drive)
    return list(found.values())


def _undirected_numbers(motion: DIRECTED) -> tuple[float | None, ...]:
    """Lists all numbers of a law but its direction."""
    undirected = motion._replace(direction=0.0)
    return tuple(None if value is None else float(value) for value in undirected)


def _refine(
    rough: S,
    finer: S | None,
    cut: Callable[[S, float], tuple[S, int]],
    order: float,
    error: _ErrorEstimate,
    most: int,
) -> tuple[S, float]:
    """Cuts steps until the error is allowed; also returns the estimate, over the allowed one.

    `rough` is about half as accurate as `finer`, the first that may do; without it the rough one
    and that with half its steps are compared. `cut` makes a solver with shorter steps that reduces
    an error (over the allowed one) to 1 if it can, and says into how many parts they were cut;
    `order` is that of convergence, cautiously; `most` bounds the steps.
    """
    seen, rough = error.motions(rough)
    kept, finer = (rough, with_halved_steps(rough)) if finer is None else (None, finer)
    parts, (motions, finer) = 2, error.motions(finer)
    while motions is not None:
        left = error.relative_difference(seen, motions) / (parts**order - 1.0)
        if kept is not None and left * parts**order <= 1.0:
            return kept, left * parts**order
        if left <= 1.0:
            return finer, left
        following, parts = cut(finer, left)
        if _n_steps(following) > most:
            return finer, left
        kept, seen = finer, motions
        motions, finer = error.motions(following)
    return finer, np.inf


def _divide_steps(solver: ImplicitSolver, left: float) -> tuple[ImplicitSolver, int]:
    parts = int(np.clip(np.ceil(min(left, 1e3) ** (1 / IMPLICIT_ORDER)), 2, MOST_PARTS))
    return replace(solver, times=time_grid.divided(solver.times, parts)), parts


def _double_steps(solver: ExplicitSolver, left: float) -> tuple[ExplicitSolver, int]:
    del left
    return with_halved_steps(solver), 2


def with_halved_steps(solver: S) -> S:
    """Cuts every step in two."""
    if isinstance(solver, ImplicitSolver):
        return replace(solver, times=time_grid.halved(solver.times))
    return replace(solver, n_steps=2 * solver.n_steps)


def _n_steps(solver: TimeSolver) -> int:
    return solver.n_steps if isinstance(solver, ExplicitSolver) else len(solver.times) - 1


def _graded(scene: Scene, end: float) -> tuple[Floats, float]:
    """Grades a grid by the drive's frequency; also returns its longest step, s."""
    rule, frequency = RULES[scene.numerics.accuracy], scene.loads.drive_frequency
    largest = (end if frequency is None else 1 / frequency) / rule.per_period
    return time_grid.graded(end, min(rule.first, largest), rule.growth, largest), largest


def _first_grid(
    scene: Scene, values: ConcreteParameters, times: Floats, threads: int, most: int
) -> ImplicitSolver:
    """Grades a grid by the drive's frequency, or adapts one to each of the drives without."""
    rule, end, frequency = (
        RULES[scene.numerics.accuracy],
        float(times[-1]),
        scene.loads.drive_frequency,
    )
    steps, largest = _graded(scene, end)
    drives = distinct_drives(scene)
    stops = _breakpoints(drives, end)
    solver = ImplicitSolver(
        replace(scene.topology, storages=FASTEST), steps, times, NEWTON, threads,
        turn_allowance=TURN_ALLOWANCE,
    )  # fmt: skip
    if frequency is not None:
        return replace(solver, times=time_grid.insert_times(steps, stops))
    sizes = [_size(scene, end, values, drive, stops) for drive in drives]
    grids = [
        adapted(solver, values, drive, rule.per_step * size, rule.first, largest, stops, most).times
        for drive, size in zip(drives, sizes, strict=True)
    ]
    return replace(solver, times=time_grid.insert_times(grids[0], np.concatenate(grids)))


def _breakpoints(drives: Sequence[PrescribedMotion], end: float) -> Floats:
    return np.unique(np.concatenate([breakpoints(each.motion, end) for each in drives]))


def _size(
    scene: Scene, end: float, values: ConcreteParameters, drive: PrescribedMotion, stops: Floats
) -> float:
    """Finds how far a drive goes, or its forces push slowly, mm (rotations times their scale).

    A push counts as the lattice's length at most: it leads a structure that floats anywhere.
    """
    top, held = scene.topology, scene.topology.unloaded.held
    at = np.union1d(np.linspace(0.0, end, SAMPLES), stops)
    size = np.abs(drive.values(top.held, at)[:, : len(held)] * top.scale[held]).max(initial=0.0)
    if len(drive.loaded) > 0:
        most = drive.forces(at)
        sizes = np.abs(most / [1.0, 1.0, top.rotation_scale]).max(axis=(1, 2))
        most = most[sizes.argmax()]
        of, right = linearised(top, values), np.zeros(3 * top.n_units)
        np.add.at(right, 3 * drive.units[:, None] + np.arange(3), most)
        with catch_warnings():
            simplefilter("ignore", spla.MatrixRankWarning)
            pushed = spla.spsolve(of.stiffness, right[of.free])
        far = np.abs(pushed * top.scale[of.free]).max(initial=0.0)
        size = max(size, np.fmin(far, np.ptp(scene.lattice.vertices, axis=0).max()))
    return float(size) or 1.0


def _explicit(
    scene: Scene, values: ConcreteParameters, times: Floats, threads: int
) -> ExplicitSolver:
    check_masses(values)
    end, accuracy = float(times[-1]), scene.numerics.accuracy
    highest = STIFFENING * highest_frequency(scene.topology, values)
    largest = STABLE_FRACTION[accuracy] * BLANES_MOAN.stability / max(highest, 1e-300)
    # a heavy or soft structure is stable with steps far too long for its drive
    if (frequency := scene.loads.drive_frequency) is not None:
        largest = min(largest, 1 / (frequency * RULES[accuracy].per_period))
    for drive in distinct_drives(scene):
        gaps = np.diff(breakpoints(drive.motion, end))
        largest = min(largest, max(gaps.min(initial=np.inf) / 2, largest / 16))
    return ExplicitSolver(scene.topology, end, int(np.ceil(end / largest)), times, threads)
