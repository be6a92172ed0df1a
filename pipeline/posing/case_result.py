"""Reduces a simulated case to motion, energies, forces, clearance, loss and their errors."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

    from pipeline.problem import Problem
    from sim.energy import Observables
    from sim.scene import Scene
    from sim.solvers import Case, Measure, Solved

from pipeline.posing.structure_variables import designed_angles, flat_vertices
from pipeline.runtime import UserError
from sim.core import Floats, Ints, SimulationError
from sim.energy import observe
from sim.quasistatics import BRANCHING, StaticRecord, StaticSolver, trace_first_snap
from sim.scene import (
    drive_force,
    estimated_errors,
    mimicking,
    relaxed,
    sample_times,
    scales,
    strain_energies,
)
from sim.solvers import solve_case
from sim.structure import clearance

CLEARANCE_STRIDE = 4
"""Gaps and overlaps of a motion in time are looked for in every so many samples."""
TICKS = 1e7
"""Parts of a horizon that times of the output are told apart by, at least."""
NOT_ASKED, UNSTABLE, STABLE = -1, 0, 1
"""Stability of a state: no equilibrium; no minimum of the energy; a minimum. More by
``LIMIT_POINT`` or ``BRANCHING`` is a minimum that it came to from where its path ended."""
LOG = logging.getLogger(__name__)


class PosedStructure(NamedTuple):
    """Holds a structure under the problem's drives, its vertices (n_vertices, 2) in mm."""

    scene: Scene
    vertices: Floats


class Times(NamedTuple):
    """Holds the times of the output."""

    asked: Floats  # all times, ascending, s
    # shown, integrated, sampled: where in them the response's own samples are, those of the loss's
    # integral, and those of the authors' sum
    shown: Ints
    integrated: Ints
    sampled: Ints


class TracedPath(NamedTuple):
    """Holds a path of equilibria through a snap, point by point; one of NaN where there is none."""

    load: Floats  # (n_points,) load parameters, s
    force: Floats  # (n_points, 2) of the drive, N
    eigenvalue: Floats  # (n_points,) smallest of the tangent, N/mm


class CaseResult(NamedTuple):
    """Holds a simulated case at the times shown, those of the loss, and (region) at all."""

    displacement: Floats
    velocity: Floats
    observables: Observables
    drive_force: Floats
    roi_energy: Floats
    gap: Floats
    overlapping: Floats
    stability: NDArray[np.int8]
    snap: Floats
    eigenvalue: Floats
    snaps: Floats
    traced: TracedPath
    region: Floats
    loss: float
    loss_other_branch: float
    loss_samples: float
    loss_error: float
    displacement_error: float


def measure(
    structure: PosedStructure, times: Times, intact: list[CaseResult] | None
) -> Measure[CaseResult]:
    """Builds the function that reduces the cases of a structure.

    `intact` are the cases of the structure to be mimicked, if one was simulated.
    """
    scene, vertices = structure
    stride = 1 if scene.loads.static else CLEARANCE_STRIDE

    def loss_of(motion: Floats, case: Case, at: Ints, weights: Floats | None) -> float:
        measure = mimicking(scene, _target(motion, scene, case.number, intact, at), weights)
        return float(measure(motion[None, at], case.values)[0])

    def other_loss(solved: Solved) -> float:
        """Loss on the other branch of where the path branches; NaN if it does not, or ends."""
        case, record = solved.case, solved.record
        if not isinstance(record, StaticRecord) or not (record.jumped == BRANCHING).any():
            return np.nan
        assert isinstance(case.solver, StaticSolver)
        mirrored = replace(case.solver, sense=-case.solver.sense)
        try:
            motion, _, _ = solve_case(mirrored, case.values, case.drive)
        except SimulationError as error:
            LOG.warning("the other branch of load case %d: %s", case.number, error)
            return np.nan
        return loss_of(motion.reshape(solved.displacement.shape), case, times.integrated, None)

    def reduce(solved: Solved) -> CaseResult:
        case, motion = solved.case, solved.displacement
        finer = case.solver.refined(solved.record)
        refined = solve_case(finer, case.values, case.drive)[0].reshape(motion.shape)
        loss, fine_loss = (
            loss_of(each, case, times.integrated, None) for each in (motion, refined)
        )
        mean = np.full(len(times.sampled), 1 / len(times.sampled))
        region, fine_region = (
            each[times.integrated][:, scene.objective.region] / scales(scene.lattice.spacing)
            for each in (motion, refined)
        )
        size = 1.0 if scene.objective.reference else fine_loss
        displacement_error, loss_error = estimated_errors(
            (region, fine_region), (loss, fine_loss), size
        )
        shown, path = motion[times.shown], _path(solved, times.shown)
        seen = observe(scene.topology, case.values, shown)
        found = clearance(scene.lattice, vertices, shown[::stride])
        return CaseResult(
            displacement=shown,
            velocity=solved.velocity[times.shown],
            observables=seen,
            drive_force=drive_force(scene, case.values, seen, case.drive, times.asked[times.shown]),
            roi_energy=_roi_energy(scene, case, shown),
            gap=_at_stride(found.gap, stride, len(shown)),
            overlapping=_at_stride(found.overlaps, stride, len(shown)),
            stability=path.stability,
            snap=path.snap,
            eigenvalue=path.eigenvalue,
            snaps=getattr(solved.record, "snaps", np.zeros(0)),
            traced=_traced(solved, scene),
            region=motion[:, scene.objective.region],
            loss=loss,
            loss_other_branch=other_loss(solved),
            loss_samples=loss_of(motion, case, times.sampled, mean),
            loss_error=loss_error,
            displacement_error=displacement_error,
        )

    return reduce


def _target(
    motion: Floats, scene: Scene, number: int, intact: list[CaseResult] | None, at: Ints
) -> Floats | None:
    """Selects the target (1, n_at, n_region, 3): the intact structure's motion, or its own."""
    if scene.objective.reference is None:
        return None
    whole = motion[:, scene.objective.region] if intact is None else intact[number].region
    return np.asarray(whole[None, at])


def _roi_energy(scene: Scene, case: Case, motion: Floats) -> Floats:
    """Sums the strain energy (n_times,) of the region's ligaments, strains counted from rest."""
    chosen = scene.region_ligaments
    units = scene.lattice.ligament_units[chosen]
    from_rest = case.values._replace(natural=np.zeros_like(case.values.natural))
    return np.asarray(strain_energies(motion, from_rest, chosen, units).sum(axis=-1))


def _at_stride(values: NDArray[np.generic], stride: int, size: int) -> Floats:
    out = np.full(size, np.nan)
    out[::stride] = values
    return out


class _Path(NamedTuple):
    """Stability along a path at the times shown: flags, loads of snaps, smallest eigenvalues."""

    stability: NDArray[np.int8]
    snap: Floats
    eigenvalue: Floats


def _path(solved: Solved, at: Ints) -> _Path:
    """Describes what happened on the way to each of the times shown (``at``, ascending)."""
    record, nothing = solved.record, np.full(len(at), np.nan)
    if not isinstance(record, StaticRecord):
        return _Path(np.full(len(at), NOT_ASKED, dtype=np.int8), nothing, nothing)
    for load in record.snaps:
        share = load / solved.case.solver.output_times[-1]
        LOG.warning("the structure snaps at %.4g of the load path", share)
    if not record.stable.all():
        LOG.warning("%d equilibria are not stable", np.count_nonzero(record.stable == 0))
    ways = np.concatenate([[0], at[:-1] + 1])
    jumped = np.maximum.reduceat(record.jumped, ways)
    flags = np.where(record.stable[at] == 1, STABLE + jumped, UNSTABLE)
    snap = np.fmax.reduceat(record.snapped, ways)
    return _Path(flags.astype(np.int8), snap, record.eigenvalue[at])


def _traced(solved: Solved, scene: Scene) -> TracedPath:
    record, case, top = solved.record, solved.case, scene.topology
    found = None
    if isinstance(record, StaticRecord) and isinstance(case.solver, StaticSolver):
        found = trace_first_snap(case.solver, case.values, case.drive, record)
    if found is None:
        return TracedPath(np.full(1, np.nan), np.full((1, 2), np.nan), np.full(1, np.nan))
    loads = case.solver.output_times
    turns = ", ".join(f"{found.loads[at] / loads[-1]:.4g}" for at in found.turns)
    LOG.info("the path that it leaves turns at %s of the load path", turns or "none")
    motion = found.states[:, : 3 * top.n_units].reshape(len(found.loads), -1, 3)
    seen = observe(top, case.values, motion)
    return TracedPath(
        found.loads,
        drive_force(scene, case.values, seen, case.drive, found.loads),
        found.eigenvalue,
    )


def structures_of(
    scene: Scene, design: xr.Dataset, *, straight: bool = False
) -> dict[str, PosedStructure]:
    """Names the structures to compare; an intact one only where something is to be mimicked.

    A cloak whose slots were designed is posed as it rests, unless its shims are to be ``straight``.

    Raises:
        UserError: it does not come to rest.
    """
    found = {
        "altered": PosedStructure(scene, scene.lattice.vertices),
        "cloaked": PosedStructure(scene, flat_vertices(scene.lattice, design["vertices"])),
    }
    if not straight and (angles := designed_angles(design)) is not None:
        found["cloaked"] = _at_rest(*found["cloaked"], angles)
    if scene.objective.reference is None:
        return found
    intact = scene.objective.reference.updated(reference=scene.objective.reference)
    return {"intact": PosedStructure(intact, intact.lattice.vertices), **found}


def _at_rest(scene: Scene, vertices: Floats, angles: Floats) -> PosedStructure:
    """Bends the shims of a structure by angles (n_ligaments, 2), rad, and lets it come to rest."""
    try:
        rest = relaxed(scene.bent(angles), vertices)
    except SimulationError as error:
        what = f"the cloaked structure does not come to rest with its slots as designed: {error}"
        raise UserError(what, remedy="design it again, or without optimiser.as_built") from error
    return PosedStructure(rest.scene, rest.vertices)


def times_of(asked: Problem, scene: Scene) -> Times:
    """Merges the output times of a problem's response, those that are alike but for rounding."""
    horizon = scene.loads.duration
    end = horizon if scene.loads.static else asked.response_time  # a path may be cut short
    shown = np.linspace(0.0, end, asked.response.samples)
    integrated = sample_times(scene)
    sampled = (
        integrated if scene.objective.steps else np.linspace(0.0, horizon, asked.horizon.samples)
    )
    wanted = (shown, integrated, sampled)
    rate, tick = max(1e9, TICKS / horizon), min(1e-9, horizon / TICKS)
    ticks = [np.round(times * rate).astype(np.int64) for times in wanted]
    every, place = np.unique(np.concatenate(ticks), return_inverse=True)
    ends = np.cumsum([len(times) for times in wanted])[:-1]
    merged = np.asarray(every * tick)
    if asked.measured:  # nothing is known beyond the end, by which the last may be rounded up
        merged = np.minimum(merged, end)
    return Times(merged, *np.split(place, ends))
