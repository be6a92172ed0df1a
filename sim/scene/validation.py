"""Validates a scene: refuses impossible geometry, supports or drives; warns of doubtful ones."""

import logging
import os
from collections.abc import Iterable, Iterator
from functools import cache
from typing import get_args

import jax
import numpy as np
import shapely

from sim.core import Floats, Ints, SimulationError
from sim.scene.expected_cost import count_unknowns, estimate_cost
from sim.scene.scene import DIRECTED, DOFS, Scene, displaced
from sim.solvers import DISPLACEMENT, FORCE, FREE, PrescribedMotion, TimeSeries, single_motions
from sim.structure import Lattice, VoidAngleContact, polygons

LOG = logging.getLogger(__name__)

SHORTEST_LIGAMENT = 1e-6
"""Of a ligament at rest, over the spacing: its law divides by its length."""
VECTOR_TOLERANCE = 1e-5
"""Over the spacing, by which a ligament may differ between given vertices and the lattice."""
JUMP, SOME_JUMP = 0.05, 0.01
"""Of a motion or force at its start, over its largest value: refused, and warned of."""
ACROSS_TOLERANCE = 1e-9
"""Part of a motion, over its largest, up to which rounding alone makes it act across."""
SUM_TOLERANCE = 1e-6
"""By which the sum of weights may be off one."""
N_INSTANTS = 513
"""At which a motion is looked at."""
_NUMBERS = (int, float, np.ndarray, np.generic, jax.Array)
LARGE_SIZE = 100_000
"""Unknowns from which on memory and time are told in advance."""


class SceneError(SimulationError):
    """Refuses a scene without a meaning; `key` is that of the problem file that it is about."""

    def __init__(self, reason: str, key: str) -> None:
        super().__init__(reason)
        self.key = key


def check_scene(
    scene: Scene, vertices: Floats | None = None, times: Floats | None = None
) -> tuple[str, ...]:
    """Checks structure, supports, drives and size; returns warnings, logged once a process.

    `vertices` (n_vertices, 2) are the structure's, mm, by default the initial ones; `times`
    (n_times,) are those of the output, s, by default the start and the end.

    Raises:
        SceneError: something has no meaning.
    """
    asked = np.array([0.0, scene.loads.duration]) if times is None else times
    check_units(scene.lattice, scene.lattice.vertices if vertices is None else vertices)
    _check_ids(scene)
    margin = scene.objective.snap_margin
    if margin is not None and not margin > 0.0:
        what = f"a snap margin of {margin:g} bounds nothing; give one above zero, or None"
        raise SceneError(what, "objective.snap_margin")
    for what, key in _invalid_numbers(scene):
        raise SceneError(what, key)
    found = [*_hanging_units(scene), *_check_size(scene, asked)]
    for number, drive in enumerate(scene.loads.cases):
        _check_law(drive, f"load case {number}")
        if not any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(drive.motion)):
            found += _check_drive(scene, drive, f"load case {number}", float(asked[-1]))
    for warning in found:
        _warn(warning)
    return tuple(found)


def _invalid_numbers(scene: Scene) -> Iterator[tuple[str, str]]:
    """Lists numbers that a loss or a law would be computed with and that have no meaning there."""
    loads, asked, law = scene.loads, scene.objective, scene.structure.contact
    shares, cases = [] if loads.weights is None else np.asarray(loads.weights).tolist(), loads.cases
    if loads.weights is not None and not (
        len(shares) == len(cases) and min(shares) >= 0.0 and abs(sum(shares) - 1.0) <= SUM_TOLERANCE
    ):
        what = f"the weights {shares} of {len(cases)} load cases; give one of each, zero or more,"
        yield f"{what} of sum 1", "drive.weights"
    for name in ("sharpness", "copy_sharpness"):
        if not (sharpness := getattr(asked, name)) > 0.0:
            yield f"a {name} of {sharpness:g} makes no mean; give 1 or more", "objective.robust"
    if not loads.duration > 0.0:
        yield f"a duration of {loads.duration:g} s; give one above zero", "horizon.duration"
    if isinstance(law, VoidAngleContact) and law.cutoff_angle < law.barrier_angle:
        what = f"contact begins at {law.cutoff_angle:g} rad, beyond its barrier of"
        what += f" {law.barrier_angle:g} rad; give a cutoff_angle above the barrier_angle"
        yield what, "contact.cutoff_angle"


@cache
def _warn(text: str) -> None:
    LOG.warning("%s", text)


def check_units(lattice: Lattice, vertices: Floats) -> None:
    """Refuses units whose edges cross, or run clockwise, and ligaments without length.

    Neither may `vertices` (n_vertices, 2), in mm, change the ligaments of the lattice.

    Raises:
        SceneError: naming the unit or the ligament.
    """
    rings = polygons(lattice, vertices)
    wrong = np.flatnonzero(
        ~shapely.is_valid(rings) | ~shapely.is_ccw(shapely.get_exterior_ring(rings))
    )
    if len(wrong) > 0:
        i, j = lattice.index[wrong[0]]
        raise SceneError(
            f"unit {wrong[0]} at [{i}, {j}] ({len(wrong)} in all) has edges that cross or corners"
            " that run clockwise, so no area and inertia of its own; move its corners",
            "lattice",
        )
    lengths = np.linalg.norm(lattice.ligament_vectors, axis=1)
    if lengths.min(initial=np.inf) < SHORTEST_LIGAMENT * lattice.spacing:
        one, other = lattice.ligament_units[lengths.argmin()]
        raise SceneError(
            f"the ligament between units {one} and {other} has no length"
            f" ({lengths.min():.3g} mm); keep corners of neighbours apart",
            "lattice.ligament_length",
        )
    _check_vectors(lattice, vertices)


def _check_vectors(lattice: Lattice, vertices: Floats) -> None:
    """Refuses vertices between which ligaments are other than the lattice's: its own are solved."""
    ends = np.asarray(vertices)[lattice.ligaments]
    away = np.linalg.norm(ends[:, 1] - ends[:, 0] - lattice.ligament_vectors, axis=1)
    if away.max(initial=0.0) > VECTOR_TOLERANCE * lattice.spacing:
        one, other = lattice.ligament_units[away.argmax()]
        raise SceneError(
            f"the vertices change the ligament between units {one} and {other} by {away.max():.3g}"
            " mm against the lattice's; move both its ends alike, or let the lattice have them, by"
            " replace(lattice, vertices=vertices)",
            "lattice",
        )


def _check_ids(scene: Scene) -> None:
    """Refuses units and degrees of freedom that there are not, and units that count twice."""
    loads, n = scene.loads, scene.lattice.n_units
    frozen = scene.design.frozen
    named = {
        "supports": [each.units for each in loads.supports],
        "drive.units": [case.units for case in loads.cases],
        "objective.region": [scene.objective.region],
        "cloak": [scene.design.cloak, *([] if frozen is None else [frozen])],
    }
    for key, ids in named.items():
        for each in ids:
            if not np.issubdtype(getattr(each, "dtype", None), np.integer):
                raise SceneError("units are no array of integers; take np.array of their ids", key)
        every = np.concatenate([np.zeros(0, dtype=np.int64), *ids])
        if len(wrong := every[(every < 0) | (every >= n)]) > 0:
            raise SceneError(f"there is no unit {wrong[0]}; the lattice has 0 to {n - 1}", key)
    for key in ("drive.units", "objective.region"):
        for each in named[key]:
            _check_unique(each, key)
    for dof in {dof for each in loads.supports for dof in each.dofs} - set(DOFS):
        raise SceneError(f"there is no {dof!r}; the dofs are {', '.join(DOFS)}", "supports")


def _check_unique(ids: Ints, key: str) -> None:
    found, count = np.unique(ids, return_counts=True)
    if len(twice := found[count > 1]) > 0:
        raise SceneError(f"unit {twice[0]} is listed twice, and would count so; list it once", key)


def check_cases(scene: Scene, numbers: Iterable[int]) -> None:
    """Refuses load cases that there are not.

    Raises:
        SceneError: naming the first of them.
    """
    n = len(scene.loads.cases)
    for wrong in (number for number in numbers if not 0 <= number < n):
        raise SceneError(f"there is no load case {wrong}; the scene has 0 to {n - 1}", "drive")


def _hanging_units(scene: Scene) -> Iterator[str]:
    count = np.bincount(scene.lattice.ligament_units.ravel(), minlength=scene.lattice.n_units)
    loose = np.setdiff1d(np.flatnonzero(count == 1), scene.loads.held // 3)
    if len(loose) > 0:
        i, j = scene.lattice.index[loose[0]]
        yield (
            f"units that hang on one ligament: {len(loose)}, the first at [{i}, {j}]; join or"
            " remove them if that is not meant"
        )


def _check_size(scene: Scene, times: Floats) -> Iterator[str]:
    """Estimates memory and time of a large structure."""
    if count_unknowns(scene) < LARGE_SIZE:
        return
    n, memory, seconds = estimate_cost(scene, times)
    told = f"{scene.lattice.n_units} units: {n} unknowns, about {memory / 1e9:.2g} GB"
    installed = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if memory > installed:
        what = f"{told}, of which this machine has {installed / 1e9:.2g}; take fewer units or steps"
        raise SceneError(what, "lattice")
    time = f", and about {max(1.0, seconds / 60):.0f} min a path" if scene.loads.static else ""
    yield f"{told}{time}"


def _check_drive(scene: Scene, drive: PrescribedMotion, case: str, end: float) -> Iterator[str]:
    for one in single_motions(drive.motion):
        if isinstance(one, TimeSeries):
            _check_series(one, case, end)
    instants = np.linspace(0.0, end, N_INSTANTS)
    with jax.ensure_compile_time_eval():  # under jax.jit, which is refused further on
        history = _sample_motion(drive, instants, case)
    _check_clamped(scene, drive, history, case)
    every_dof = history
    if drive.control is not None:
        history = np.where(drive.control == DISPLACEMENT, history, 0.0)
    far = float(np.hypot(history[..., 0], history[..., 1]).max(initial=0.0))
    size = np.ptp(scene.lattice.vertices, axis=0)
    turned_over = bool(np.abs(history[..., 2]).max(initial=0.0) > np.pi / 2)
    if not far <= (1 + turned_over) * size.max():  # a strip's end, folded back, goes twice as far
        raise SceneError(
            f"{case} moves its units by {far:.4g} mm, further than {'twice ' * turned_over}the"
            f" lattice is long ({size[0]:.4g} by {size[1]:.4g} mm); lower the amplitude",
            "drive.amplitude",
        )
    if scene.loads.static:
        others = np.setdiff1d(scene.loads.held, displaced(drive))
        _check_resistance(others, history, case)
        _check_supports(scene, case)
        return
    yield from _check_start(scene, drive, every_dof, case)


def _check_law(drive: PrescribedMotion, case: str) -> None:
    """Refuses motions that are no laws: of numbers alone, which NumPy and JAX can compute."""
    remedy = "give sim.TimeSeries(times, motion) of its values, or a NamedTuple of its numbers"
    remedy += " whose __call__ takes times (n_times,) and computes in times.__array_namespace__()"
    for one in single_motions(drive.motion):
        if not _holds_numbers(one):
            name = getattr(one, "__name__", type(one).__name__)
            what = f"{case} moves by {name}, which is no law of motion; {remedy}"
            raise SceneError(what, "drive")
        if isinstance(one, (*get_args(DIRECTED), TimeSeries)):
            continue
        try:
            jax.eval_shape(lambda law, times: law(times), one, np.zeros(2))
        except TypeError as error:
            what = f"{case} moves by {type(one).__name__}, which JAX cannot differentiate by time"
            raise SceneError(f"{what}; {remedy}", "drive") from error


def _holds_numbers(motion: object) -> bool:
    """Tells whether a motion can be computed, and is told by numbers alone."""
    leaves = jax.tree.leaves(motion)
    return callable(motion) and all(isinstance(leaf, _NUMBERS) for leaf in leaves)


def _sample_motion(drive: PrescribedMotion, instants: Floats, case: str) -> Floats:
    """Computes the motion (n_times, n_driven or 1, 3) at some times; refuses other shapes."""
    history = np.asarray(drive.motion(instants), dtype=float)
    n_times, n_units = len(instants), len(drive.units)
    if history.shape not in {(n_times, 3), (n_times, n_units, 3)}:
        raise SceneError(
            f"{case} moves {n_units} units by motions of the shape {history.shape} at {n_times}"
            f" times; give ux, uy, theta at each: ({n_times}, 3), or ({n_times}, {n_units}, 3)",
            "drive",
        )
    return history.reshape(n_times, -1, 3)


def _check_start(
    scene: Scene, drive: PrescribedMotion, history: Floats, case: str
) -> Iterator[str]:
    """Refuses displacements, or forces, that do not start at zero; warns of small ones.

    The history (n_times, n_driven, 3) has both; either is measured by its own largest value.
    """
    size, arm = np.abs(history).max(axis=0), scene.lattice.spacing / 2
    sizes = np.abs(np.where(size > ACROSS_TOLERANCE * size.max(initial=0.0), history, 0.0))
    control = DISPLACEMENT if drive.control is None else drive.control
    measured = any(isinstance(one, TimeSeries) for one in single_motions(drive.motion))
    way, key = ("by a delay of three widths or rise times or more", "drive.delay")
    if measured:
        way, key = ("from zero in all columns", "drive.file")
    for kind, what, turned in ((DISPLACEMENT, "displacement", arm), (FORCE, "force", 1.0 / arm)):
        every_dof = np.where(control == kind, sizes * [1.0, 1.0, turned], 0.0).max(axis=(1, 2))
        jump = every_dof[0] / max(every_dof.max(), 1e-300)
        said = f"{case} starts with a jump, of {jump:.2g} of its largest {what}"
        if jump > JUMP:
            raise SceneError(f"{said}; let it start from rest, {way}", key)
        if jump > SOME_JUMP:
            yield said


def _check_clamped(scene: Scene, drive: PrescribedMotion, history: Floats, case: str) -> None:
    """Refuses motions and forces, in the history (n_times, n_driven, 3), of what is clamped."""
    size = np.abs(history).max(axis=0)
    acts = np.broadcast_to(size > ACROSS_TOLERANCE * size.max(initial=0.0), (len(drive.units), 3))
    if drive.control is not None:
        acts = acts & (drive.control != FREE)
    dofs = (3 * drive.units[:, None] + np.arange(3))[acts]
    if len(both := np.intersect1d(dofs, scene.loads.clamped)) > 0:
        unit, dof = divmod(int(both[0]), 3)
        raise SceneError(
            f"unit {unit} is driven by {case} and clamped, along {DOFS[dof]}; drive or clamp it,"
            " not both",
            "drive.units",
        )


def _check_series(motion: TimeSeries, case: str, end: float) -> None:
    times = np.asarray(motion.times, dtype=float)
    if len(times) != len(motion.motion) or len(times) < 2 or not (np.diff(times) > 0).all():
        raise SceneError(
            f"the times of {case} do not ascend, or are not one for each of its motions; sort them,"
            " each once",
            "drive.file",
        )
    slack = 1e-9 * end
    if times[0] > slack or times[-1] < end - slack:
        raise SceneError(
            f"{case} is known from {times[0]:.6g} to {times[-1]:.6g} s, and is asked for from 0 to"
            f" {end:.6g} s; give a longer series, or a shorter horizon",
            "drive.file",
        )


def _check_supports(scene: Scene, case: str) -> None:
    """Refuses a static load of a structure that is free to move or turn as a rigid body."""
    if not scene.is_held:
        raise SceneError(
            f"nothing holds the structure against {case}: it can move or turn as one; clamp some"
            " units",
            "supports",
        )


def _check_resistance(held: Ints, history: Floats, case: str) -> None:
    """Refuses a static load that nothing resists: all driven units move alike, without a turn.

    `held` are the dofs (n,) that are held besides; `history` (n_times, n_driven, 3).
    """
    # of the cosine of a direction across
    noise = ACROSS_TOLERANCE * np.abs(history).max(initial=0.0)
    uniform = (history[..., 2] == 0).all() and (np.abs(history - history[:, :1]) <= noise).all()
    moves = np.flatnonzero((np.abs(history[..., :2]) > noise).any(axis=(0, 1)))
    if uniform and len(moves) > 0 and not np.isin(held % 3, moves).any():
        raise SceneError(
            f"nothing holds the structure against {case}: it moves along as one; clamp some units",
            "supports",
        )
