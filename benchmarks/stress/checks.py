"""Checks answers independently: balance, stability, barriers, overlaps, energy, smaller steps."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from benchmarks.stress.reference_energy import ReferenceStructure, balance, stiffness
from benchmarks.stress.stress_scenes import StressScene
from benchmarks.stress.verdicts import Check
from sim.core import Floats, Ints, SimulationError
from sim.quasistatics import static_solver
from sim.solvers import Solver, solve_case
from sim.structure import DistanceContact, clearance, displaced, void_angles
from sim.time_integration import explicit, implicit

LARGEST_IMBALANCE = 1e-6
"""Largest distance of an equilibrium from the one that the definition has, relative to the largest
displacement, mm/mm."""
RESIDUAL_LIMIT = 50.0
"""A stage's own criterion is an estimate from how fast its iteration contracts."""
ADVICE = "accuracy: tight"
MOST_STAGES = 24
"""Stages of an implicit run whose balance is checked, evenly spread."""


class Answer(NamedTuple):
    """Holds a solver's answer: displacement and velocity (n_asked, n_dofs), and its record."""

    displacement: Floats
    velocity: Floats
    record: static_solver.StaticRecord | implicit.ImplicitRecord | explicit.ExplicitRecord


def solved(case: StressScene, solver: Solver) -> Answer:
    """Solves one case by ``sim.solvers.solve_case``."""
    return Answer(*solve_case(solver, case.values, case.drive))


def equilibria(case: StressScene, loads: Floats, halving: bool = False) -> list[Check]:
    """Solves for equilibria and checks them, on request also against a path of smaller steps.

    Raises:
        SimulationError: there is none, or the record says that one is not stable.
    """
    solver = case.solver(loads)
    answer = solved(case, solver)
    checks = [
        *check_admissible(case, answer.displacement),
        *check_balance(case, answer),
        check_held_dofs(case, answer.displacement, loads),
    ]
    if halving:
        finer = solved(case, solver.refined(answer.record))
        checks.append(
            Check("change with smaller steps", largest_difference(case, answer, finer), 1e-6)
        )
    return checks


def check_balance(case: StressScene, answer: Answer) -> list[Check]:
    """Checks the distance of equilibria from the definition's, and that these are minima."""
    record = answer.record
    assert isinstance(record, static_solver.StaticRecord)
    if not record.stable.all():
        raise SimulationError(
            f"the record says that load {int(record.stable.argmin())} has no stable equilibrium;"
            " try another design or more load steps"
        )
    free = case.topology.free_dofs
    distance, negative = 0.0, 0
    for state in answer.displacement:
        away, below = _newton(case.structure, state, free)
        distance = float(np.maximum(distance, _size(case, away) / max(1.0, _size(case, state))))
        negative = max(negative, below)
    return [
        Check("distance from balance, mm/mm", distance, LARGEST_IMBALANCE),
        Check("falling directions of an equilibrium", negative, 0),
    ]


def _newton(of: ReferenceStructure, state: Floats, free: Ints) -> tuple[Floats, int]:
    """Returns Newton's step (n_dofs,) to balance, and the stiffness's number of negative pivots."""
    step = np.zeros_like(state)
    if len(free) == 0:
        return step, 0
    matrix = stiffness(of, state)[free][:, free]
    factor = _factor(sp.csc_array(matrix))
    step[free] = factor.solve(balance(of, state).force[free])
    return step, negative_pivots(factor)


def _factor(matrix: sp.csc_array) -> spla.SuperLU:
    """Factorises with pivots on the diagonal: their signs are the matrix's inertia."""
    try:
        return spla.splu(
            matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError as singular:
        raise SingularError(str(singular)) from singular


class SingularError(Exception):
    """Reports that the stiffness of the definition is singular in a state."""


def negative_pivots(factor: spla.SuperLU) -> int:
    """Counts the negative eigenvalues of a symmetric matrix, from its factor."""
    if not np.array_equal(factor.perm_r, factor.perm_c):
        raise SingularError("a pivot left the diagonal")
    return int((factor.U.diagonal() < 0).sum())


def check_held_dofs(case: StressScene, states: Floats, times: Floats) -> Check:
    """Checks the distance of the driven units from their motion, mm or rad."""
    expected = np.asarray(case.drive.motion(times), dtype=float)
    expected = expected[:, None] if expected.ndim == 2 else expected
    moved = states.reshape(len(states), -1, 3)[:, case.drive.units]
    return Check("driven units off their motion", float(np.abs(moved - expected).max()), 1e-9)


def check_admissible(case: StressScene, states: Floats) -> list[Check]:
    """Checks finite numbers, voids within their barrier, no overlap of units: by geometry."""
    motion = states.reshape(len(states), -1, 3)
    checks = [Check("numbers that are not finite", int((~np.isfinite(states)).sum()), 0)]
    if not checks[0].within_limit:
        return checks
    lattice, law = case.scene.lattice, case.scene.structure.contact
    if isinstance(law, DistanceContact):
        overlaps = clearance(lattice, case.vertices, motion).overlaps
        return [*checks, Check("overlapping pairs of units", int(overlaps.max()), 0)]
    if lattice.n_ligaments == 0:
        return checks
    turned = np.array([case.values.void + _reached_turns(case, state) for state in motion])
    seen = np.array([np.asarray(_void_angles(case, state)) for state in motion])
    off = np.abs((turned - seen + np.pi) % (2 * np.pi) - np.pi).max()
    beyond = np.rad2deg(law.barrier_angle - turned.min())
    return [
        *checks,
        Check("void angles off their geometry, rad", float(off), 1e-8),
        Check("voids beyond the barrier by, deg", float(beyond), 0.0),
    ]


def _reached_turns(case: StressScene, state: Floats) -> Floats:
    a, b = case.scene.lattice.ligament_units.T
    turn = state[a, 2] - state[b, 2]
    return np.stack([turn, -turn], axis=1)


def _void_angles(case: StressScene, state: Floats) -> Floats:
    lattice = case.scene.lattice
    return np.asarray(void_angles(lattice, displaced(lattice, case.vertices, state[None])[0]))


def motions(
    case: StressScene, asked: Floats | int, error: float, solver: Solver | None = None
) -> list[Check]:
    """Integrates a motion and checks it, also against one of half the steps.

    `asked` are times of the output, s, or how many from zero to the end; `error` is what half the
    steps may find, root mean square relative to that of the motion. The solver is the plan's by
    default.

    Raises:
        SimulationError: it cannot be integrated.
    """
    if isinstance(asked, int):
        asked = np.linspace(0.0, case.scene.loads.duration, asked)
    used = solver or case.solver(asked)
    answer = solved(case, used)
    checks = [
        *check_admissible(case, answer.displacement),
        check_held_dofs(case, answer.displacement, asked),
    ]
    if isinstance(answer.record, implicit.ImplicitRecord):
        assert isinstance(used, implicit.ImplicitSolver)
        checks += stages(case, used, answer.record)
    finer = solved(case, used.refined(answer.record))
    return [
        *checks,
        Check("change with half the steps", rms_difference(case, answer, finer), error, True),
    ]


def motions_as_advised(case: StressScene, asked: Floats | int, error: float) -> list[Check]:
    """Integrates as planned by default; if that is not enough by its own account, tight.

    Raises:
        SimulationError: it cannot be integrated, or not without other changes.
    """
    try:
        checks = motions(case, asked, error)
    except SimulationError as refusal:
        if ADVICE not in str(refusal):
            raise
    else:
        if all(check.within_limit or not check.stated for check in checks):
            return checks
    return motions(replace(case, scene=case.scene.updated(accuracy="tight")), asked, error)


def stages(
    case: StressScene, solver: implicit.ImplicitSolver, record: implicit.ImplicitRecord
) -> list[Check]:
    """Checks the distance of implicit stages from the definition's, over the tolerance."""
    tableau, times = solver.tableau, record.times
    n_steps, n_stages = len(times) - 1, len(tableau.nodes)
    every = [(n, s) for n in range(n_steps) for s in range(1, n_stages)]
    chosen = every[:: max(1, len(every) // MOST_STAGES)]
    free, mass = case.topology.free_dofs, case.values.mass.ravel()
    damping, worst, negative = case.values.damping.ravel(), 0.0, 0
    for n, s in chosen:
        h = times[n + 1] - times[n]
        k = h * tableau.stages[s, s]
        state = record.u[n, s]
        inertia = mass * record.a[n, s] + damping * record.v[n, s]
        right = (balance(case.structure, state).force - inertia)[free]
        matrix = stiffness(case.structure, state)[free][:, free]
        more = sp.diags_array(((mass / k + damping) / k)[free], format="csc")
        factor = _factor(sp.csc_array(matrix + more))
        step = np.zeros_like(state)
        step[free] = factor.solve(right)
        worst = float(np.maximum(worst, _size(case, step) / max(solver.tolerance * h, 1e-12)))
        negative = max(negative, negative_pivots(factor))
    return [
        Check("stages off balance, tolerances", worst, RESIDUAL_LIMIT),
        Check("falling directions of a stage", negative, 0),
    ]


def energies(case: StressScene, answer: Answer) -> Floats:
    """Computes kinetic and elastic energy (n_asked,), N mm."""
    rates = answer.velocity.copy()
    rates[:, case.topology.held] = 0.0
    kinetic = 0.5 * rates**2 @ case.values.mass.ravel()
    return kinetic + [balance(case.structure, state).energy for state in answer.displacement]


def work(case: StressScene, answer: Answer, times: Floats) -> tuple[Floats, Floats]:
    """Computes work of the drive and energy lost to damping (n_asked,) up to each time, N mm.

    By the trapezoidal rule, so the times must resolve the motion.
    """
    held = case.topology.held
    pull = -np.array([balance(case.structure, state).force for state in answer.displacement])
    power = (pull[:, held] * answer.velocity[:, held]).sum(axis=1)
    rates = answer.velocity.copy()
    rates[:, held] = 0.0
    return _integral(power, times), _integral(rates**2 @ case.values.damping.ravel(), times)


def _integral(values: Floats, times: Floats) -> Floats:
    parts = (values[1:] + values[:-1]) / 2 * np.diff(times)
    return np.concatenate([[0.0], np.cumsum(parts)])


def largest_difference(case: StressScene, one: Answer, other: Answer) -> float:
    """Returns the largest difference of two answers over the largest displacement."""
    size = max(_size(case, one.displacement), 1e-9)
    return _size(case, one.displacement - other.displacement) / size


def rms_difference(case: StressScene, one: Answer, other: Answer) -> float:
    """Returns the root mean square difference of two answers over that of the first."""
    scale = case.topology.scale
    off, size = (
        float(np.sqrt(np.mean((states * scale) ** 2)))
        for states in (one.displacement - other.displacement, one.displacement)
    )
    return off / max(size, 1e-9)


def _size(case: StressScene, states: Floats) -> float:
    """Returns the largest displacement, rotations times the rotation scale, mm."""
    return float(np.abs(states * case.topology.scale).max(initial=0.0))
