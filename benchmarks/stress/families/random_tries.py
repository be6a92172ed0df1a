"""Tries random scenes, each against another solver: its error is at most thrice what is stated."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import count

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.scenes import MATERIAL
from benchmarks.stress import (
    STATED_OVER_TRUE,
    Check,
    StressCase,
    StressScene,
    attempt,
    check_balance,
    endless_family,
    posed,
    pressed,
    shaken,
    solved,
    squares,
)
from sim.core import Floats
from sim.energy import gradient, system_of, workspace
from sim.quasistatics import StaticRecord, trace
from sim.scene import Response, estimated_errors, sample_times, scales, simulate
from sim.solvers import Harmonic, LinearRamp, MotionLaw, PrescribedMotion, Pulse
from sim.structure import quads
from sim.vibration import lowest_frequency

FEW = 2
"""Tries of a small family."""
MOST = 3.0
"""Largest true error over the stated one."""
ROUNDING = 1e-9
"""Relative error below which nothing is stated."""
SHORT = 0.2
"""Steps of a path that counts as true, mm."""
AMPLITUDE = 1.0
"""Of motions in time, mm."""


def _tries(name: str, small: bool, check: Callable[[int], Sequence[Check]]) -> Iterator[StressCase]:
    for seed in range(FEW) if small else count():
        yield attempt(f"{name}, draw {seed}", check, seed, expected="either")


def _compare_errors(true: float, stated: float) -> list[Check]:
    """Compares a relative error with what is stated of it."""
    off = true / max(MOST * stated, ROUNDING)
    checks = [Check("true error over three times the stated one", off, 1.0)]
    if max(true, stated) > ROUNDING:
        checks.append(Check(STATED_OVER_TRUE, stated / max(true, ROUNDING), np.inf))
    return checks


@endless_family
def skips(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    yield from _tries("four directions", small, _turned)


def _turned(seed: int) -> Sequence[Check]:
    random, lattice = np.random.default_rng(seed), squares(5)
    if random.random() < 0.5:
        kept = random.permutation(lattice.n_ligaments)[random.integers(1, 4) :]
        lattice = replace(lattice, ligaments=lattice.ligaments[np.sort(kept)])
    factor = np.ones(lattice.n_ligaments)
    if random.random() < 0.7:
        factor = random.uniform(0.5, 2.0, lattice.n_ligaments)
    material = MATERIAL._replace(bending_stiffness=MATERIAL.bending_stiffness * factor)
    first = float(random.uniform(0.0, np.pi))
    ramps = [LinearRamp(AMPLITUDE, 1.0, first + k * np.pi / 2) for k in range(4)]
    alone = [shaken(lattice, ramp, static=True, steps=2, material=material) for ramp in ramps]
    scene = alone[0].scene
    drives = tuple(PrescribedMotion(alone[0].drive.units, ramp) for ramp in ramps)
    together = scene.updated(cases=drives)
    plan_losses = np.asarray(simulate(together).losses)
    checks: list[Check] = []
    for case, loss in zip(alone, plan_losses, strict=True):
        checks += check_balance(case, solved(case, case.solver(sample_times(case.scene))))
        other = float(simulate(case.scene).loss)
        checks.append(Check("loss off that of one case", abs(loss - other) / other, 1e-8))
    return checks


@endless_family
def drives(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    yield from _tries("harmonic", small, _harmonic)


def _harmonic(seed: int) -> Sequence[Check]:
    random = np.random.default_rng(seed)
    ratio, damping = np.exp(random.uniform(np.log([0.05, 0.05]), np.log([5.0, 1.0])))
    at_rest = shaken(squares(5), Harmonic(AMPLITUDE, 1.0))
    lowest = lowest_frequency(at_rest.topology, at_rest.values) / (2.0 * np.pi)
    frequency, angle = float(ratio * lowest), float(random.uniform(0.0, np.pi))
    periods = 2.0 if ratio < 0.5 else 5.0
    motion = Harmonic(AMPLITUDE, frequency, angle)
    return _in_time(motion, periods / frequency, float(damping), frequency=frequency)


@endless_family
def pulses(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    yield from _tries("pulse", small, _pulse)


def _pulse(seed: int) -> Sequence[Check]:
    random = np.random.default_rng(seed)
    width = float(np.exp(random.uniform(np.log(1e-3), np.log(3e-2))))
    delay, angle = float(random.uniform(4.0, 20.0)) * width, float(random.uniform(0.0, np.pi))
    damping = float(np.exp(random.uniform(np.log(0.05), 0.0)))
    return _in_time(Pulse(AMPLITUDE, width, angle, delay), delay + 4.0 * width, damping)


def _in_time(
    motion: Harmonic | Pulse, duration: float, damping: float, **more: float
) -> Sequence[Check]:
    """Compares a motion in time, and what is stated of its error, with that by DOP853."""
    weaker = {
        name: damping * getattr(MATERIAL, name)
        for name in ("damping_translation", "damping_rotation")
    }
    case = shaken(squares(5), motion, duration=duration, **more).with_material(**weaker)
    response = simulate(case.scene)
    finer, exact = response.refined(), _by_dop853(case, motion)
    ours, half, truth = (
        np.asarray(each)[:, :, case.scene.objective.region] / scales(case.scene.lattice.spacing)
        for each in (response.displacement, finer.displacement, exact)
    )
    right = Response(response.scene, response.plan, response.parameters, (0,), exact, exact)
    losses = [float(each.loss) for each in (response, finer, right)]
    stated = estimated_errors((ours, half), (losses[0], losses[1]), losses[1])
    moved = float(np.linalg.norm(ours - truth) / np.linalg.norm(truth))
    return [
        *_compare_errors(moved, stated[0]),
        *_compare_errors(abs(losses[0] / losses[2] - 1.0), stated[1]),
    ]


def _by_dop853(case: StressScene, motion: Harmonic | Pulse) -> Floats:
    """Integrates M u'' = -C u' - dE/du to 1e-9; the motion (1, n_times, n_units, 3)."""
    system, times = system_of(case.topology, case.values), sample_times(case.scene)
    work, free, unit = workspace(system), case.topology.free_dofs, int(case.drive.units[0])
    along = np.array([np.cos(motion.direction), np.sin(motion.direction)])
    mass, damping = system.mass[free], system.damping[free]
    state = np.zeros(case.topology.n_dofs)

    def place(time: float) -> Floats:
        if isinstance(motion, Harmonic):
            size = np.sin(2.0 * np.pi * motion.frequency * time)
        else:
            size = np.exp(-(((time - motion.delay) / motion.width) ** 2))
        return np.asarray(motion.amplitude * size * along)

    def rate(time: float, y: Floats) -> Floats:
        state[free], state[3 * unit : 3 * unit + 2] = y[: len(free)], place(time)
        gradient(state, system, work.kinematics, work.force)
        speed = y[len(free) :]
        return np.concatenate([speed, -(work.force[free] + damping * speed) / mass])

    span, rest = (0.0, float(times[-1])), np.zeros(2 * len(free))
    found = solve_ivp(rate, span, rest, "DOP853", t_eval=times, rtol=1e-9, atol=1e-11)
    out = np.zeros((len(times), case.topology.n_dofs))
    out[:, free] = found.y[: len(free)].T
    out[:, 3 * unit : 3 * unit + 2] = [place(time) for time in times]
    return out.reshape(1, len(times), -1, 3)


@endless_family
def grids(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    yield from _tries("crumpled", small, _crumpled)


def _crumpled(seed: int) -> Sequence[Check]:
    random = np.random.default_rng(seed)
    lattice, share = squares(5), float(random.uniform(0.05, 0.15))
    shift = random.uniform(-1.0, 1.0, lattice.vertices.shape)
    crumpled = replace(lattice, vertices=lattice.vertices + 0.75 * shift)
    return _traced(pressed(crumpled, share), np.append(np.sort(random.uniform(0.05, 1.0, 7)), 1.0))


@endless_family
def bifurcations(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    yield from _tries("chain", small, _bent)


def _bent(seed: int) -> Sequence[Check]:
    random = np.random.default_rng(seed)
    length = int(random.integers(5, 16))
    ramp: MotionLaw = LinearRamp(-0.3 * length, 1.0)
    chain = quads(length, 1, 15.0, 2.25, 0.0)
    size = 10.0 ** random.uniform(-8.0, -0.5)
    bow = size * np.sin(np.pi * chain.vertices[:, 0] / np.ptp(chain.vertices[:, 0]))
    bent = replace(chain, vertices=chain.vertices + np.stack([0.0 * bow, bow], axis=1))
    return _traced(
        posed(bent, [0], [length - 1], ramp, static=True),
        np.append(np.sort(random.uniform(0.01, 1.0, 7)), 1.0),
    )


def _traced(case: StressScene, loads: Floats) -> Sequence[Check]:
    """Compares states up to the first snap, and its load, with the path traced by arc length."""
    answer = solved(case, case.solver(loads))
    record = answer.record
    assert isinstance(record, StaticRecord)
    checks = check_balance(case, answer)
    snap = record.snaps[0] if len(record.snaps) else np.inf
    rest = np.zeros(case.topology.n_dofs)
    end = min(snap * (1.0 + 1e-6), 1.0)
    path = trace(case.topology, case.values, case.drive, (0.0, rest), end, 2000, SHORT)
    # a step may pass from a branch that is nearly straight to the straight one, which is unstable
    lost = np.flatnonzero(path.n_negative)
    turns = path.loads[path.turns]
    stable = path.loads[: lost[0]] if len(lost) else path.loads
    known = min(snap, stable[-1] if len(lost) else np.inf)
    if not np.isfinite(snap):
        checks.append(Check("turns of a path that does not snap", len(turns), 0))
    elif len(turns):
        checks.append(Check("load of a snap off the turn", abs(turns[0] - snap), 1e-6))
    for load, state in zip(loads[loads < known], record.states, strict=False):
        before = int(np.flatnonzero(stable <= load)[-1])
        start = float(path.loads[before]), path.states[before]
        near = trace(case.topology, case.values, case.drive, start, float(load), 60, SHORT)
        # nearest on the last piece of it: by the load it would be far off where that turns back
        ends = near.states[-2:] * case.topology.scale
        along, ahead = ends[1] - ends[0], state * case.topology.scale - ends[0]
        share = np.clip(along @ ahead / (along @ along), 0.0, 1.0)
        off = np.abs(share * along - ahead).max()
        checks.append(Check("state off the traced path, mm", float(off), 0.05))
    return checks
