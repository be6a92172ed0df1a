"""Rigid units against elastic ones: plane stress, by scikit-fem, each condensed to its vertices."""

from itertools import pairwise
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from skfem import Basis, ElementQuad2, ElementVector, MeshQuad, asm
from skfem.models.elasticity import lame_parameters, linear_elasticity

from pipeline import problem
from pipeline.posing import SOFT, compliance_shares, scene_of
from pipeline.runtime import ROOT
from sim.core import Floats
from sim.energy import LigamentLaw, ligament_energy
from sim.scene import Scene, concrete_parameters, simulate
from sim.solvers import Harmonic
from sim.structure import ConcreteParameters

MODULUS, POISSON, THICKNESS = 2000.0, 0.35, 8.1
"""Of printed units: MPa, one, mm."""
GRIP = 1.0
"""Radius about a vertex within which the shim holds the unit, mm."""
REFINED = 4
"""Times that a unit's one element is cut in four."""
STEP = 2.5e-4
"""Of the trapezoidal rule, s."""
AMPLITUDE = 4.5
"""Of Figure 2's drive, mm."""


class Cloak(NamedTuple):
    """Figure 2's cloak, its scene, and what moves it."""

    scene: Scene
    vertices: Floats
    values: ConcreteParameters


@pytest.fixture(scope="module")
def cloak() -> Cloak:
    path = ROOT / "experiments/fig2/problem.yaml"
    scene = scene_of(problem.load(path), path.parent)
    vector = np.loadtxt(ROOT / "tests/data/fig2_design.csv")
    vertices = np.asarray(scene.space.vertices(vector))
    return Cloak(scene, vertices, concrete_parameters(scene, vertices))


def condensed(corners: Floats) -> Floats:
    """Stiffness (12, 12) of a unit by displacement (mm) and rotation (rad) of its four grips."""
    mesh = MeshQuad(corners.T.copy(), np.arange(4)[:, None]).refined(REFINED)
    basis = Basis(mesh, ElementVector(ElementQuad2()))
    # plane stress: of a plane strain with another first Lame parameter
    first, second = lame_parameters(MODULUS, POISSON)
    first = 2.0 * first * second / (first + 2.0 * second)
    stiffness = THICKNESS * sp.csc_array(asm(linear_elasticity(first, second), basis))
    place, axis = basis.doflocs.T, np.zeros(basis.N, dtype=int)
    axis[
        np.concatenate(
            [
                rows[1::2].ravel()
                for rows in (basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs)
            ]
        )
    ] = 1
    away = np.linalg.norm(place[:, None] - corners, axis=2)
    held = np.flatnonzero(away.min(axis=1) <= GRIP)
    free = np.setdiff1d(np.arange(basis.N), held)
    of_grips = np.zeros((len(held), 12))
    for row, dof in enumerate(held):
        corner = int(away[dof].argmin())
        arm = place[dof] - corners[corner]
        of_grips[row, 3 * corner + axis[dof]] = 1.0
        of_grips[row, 3 * corner + 2] = (-arm[1], arm[0])[axis[dof]]
    across = stiffness[free][:, held] @ of_grips
    inner = sp.linalg.splu(sp.csc_matrix(stiffness[free][:, free])).solve(across)
    return np.asarray(of_grips.T @ (stiffness[held][:, held] @ of_grips) - across.T @ inner)


def of_ligaments(cloak: Cloak) -> Floats:
    """Stiffness (n, 6, 6) of the ligaments by displacement and rotation of their two ends."""

    def energy(ends: jax.Array, vector: jax.Array, law: jax.Array) -> jax.Array:
        still = jnp.zeros(2)
        return ligament_energy(ends[:3], ends[3:], still, still, vector, LigamentLaw(*law))

    hessian = jax.vmap(jax.hessian(energy), in_axes=(None, 0, 0))
    return np.asarray(hessian(jnp.zeros(6), cloak.values.vector, cloak.values.law))


def joined(cloak: Cloak) -> Floats:
    """Stiffness (3 n_vertices, 3 n_vertices) of the ligaments between the vertices."""
    lattice = cloak.scene.lattice
    ends = (3 * lattice.ligaments[:, :, None] + np.arange(3)).reshape(-1, 6)
    size = 3 * lattice.n_vertices
    out = np.zeros((size, size))
    for dofs, block in zip(ends, of_ligaments(cloak), strict=True):
        out[np.ix_(dofs, dofs)] += block
    return out


def split(cloak: Cloak) -> tuple[Floats, Floats]:
    """Motions of the vertices with their rigid units, and an orthonormal base of all others."""
    lattice, corner = cloak.scene.lattice, cloak.values.corner
    rigid = np.zeros((3 * lattice.n_vertices, 3 * lattice.n_units))
    for vertex, (unit, (x, y)) in enumerate(zip(lattice.unit, corner, strict=True)):
        block = [[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]]
        rigid[3 * vertex : 3 * vertex + 3, 3 * unit : 3 * unit + 3] = block
    others = [
        la.null_space(rigid[12 * unit : 12 * unit + 12, 3 * unit : 3 * unit + 3].T)
        for unit in range(lattice.n_units)
    ]
    return rigid, la.block_diag(*others)


def unit_stiffnesses(cloak: Cloak) -> list[Floats]:
    """Stiffnesses (12, 12) of all units, those that are alike computed once."""
    corners = cloak.vertices.reshape(-1, 4, 2)
    corners = corners - corners[:, :1]
    _, first, which = np.unique(
        corners.round(6).reshape(-1, 8), axis=0, return_index=True, return_inverse=True
    )
    found = [condensed(corners[unit]) for unit in first]
    return [found[k] for k in which.ravel()]


def loss_of(cloak: Cloak, stiffness: Floats) -> float:
    """Mean loss of linear motions (stiffness of the units' dofs), by the trapezoidal rule."""
    scene, values = cloak.scene, cloak.values
    held, count = scene.topology.held, round(scene.loads.duration / STEP)
    free = np.setdiff1d(np.arange(len(stiffness)), held)
    times = np.linspace(0.0, scene.loads.duration, count + 1)
    drives = np.zeros((count + 1, len(stiffness), len(scene.loads.cases)))
    for case, drive in enumerate(scene.loads.cases):
        dofs = (3 * drive.units[:, None] + np.arange(3)).ravel()
        drives[:, dofs, case] = np.tile(np.asarray(drive.motion(times)), len(drive.units))
    mass, damping = (np.ravel(part)[free] for part in (values.mass, values.damping))
    inner, coupling = stiffness[np.ix_(free, free)], stiffness[np.ix_(free, held)]
    # M (v' - v) / h + C (v' + v) / 2 + K (q' + q) / 2 = f, q' = q + h (v' + v) / 2
    left = la.lu_factor(np.diag(mass / STEP + damping / 2) + STEP / 4 * inner)
    place, speed = np.zeros((2, len(free), drives.shape[2]))
    weight, out = np.tile([1 / scene.lattice.spacing] * 2 + [1.0], scene.lattice.n_units), []
    region = np.isin(free // 3, scene.objective.region)
    for before, after in pairwise(drives):
        force = coupling @ ((before + after)[held] / 2) + inner @ (place + STEP / 4 * speed)
        ahead = la.lu_solve(left, (mass / STEP - damping / 2)[:, None] * speed - force)
        place = place + STEP / 2 * (speed + ahead)
        speed = ahead
        out.append((weight[free][region, None] * place[region]) ** 2)
    return float(np.sum(out) * STEP / drives.shape[2])


@pytest.fixture(scope="module")
def losses(cloak: Cloak) -> tuple[float, float]:
    ligaments, (rigid, others) = joined(cloak), split(cloak)
    with_units = ligaments + la.block_diag(*unit_stiffnesses(cloak))
    between = others.T @ with_units @ rigid
    stiff = rigid.T @ ligaments @ rigid
    soft = stiff - between.T @ la.solve(others.T @ with_units @ others, between, assume_a="pos")
    return loss_of(cloak, stiff), loss_of(cloak, soft)


def test_elastic_units_change_the_loss_by_a_per_cent_at_most(losses: tuple[float, float]) -> None:
    rigid, elastic = losses
    assert 0.004 < abs(elastic / rigid - 1) < 0.012


def test_small_drives_move_rigid_units_linearly(cloak: Cloak, losses: tuple[float, float]) -> None:
    angles = [
        motion.direction for motion in cloak.scene.loads.motions if isinstance(motion, Harmonic)
    ]
    tiny = [Harmonic(1e-3 * AMPLITUDE, 2.0, angle) for angle in angles]
    found = simulate(cloak.scene.driven_by(*tiny), vertices=cloak.vertices)
    assert 1e6 * float(found.loss) == pytest.approx(losses[0], rel=2e-4)


def shares_by_elements(cloak: Cloak) -> Floats:
    """Largest ratios (n_units,) of a unit's compliance to its ligaments', under any loads."""
    lattice, held = cloak.scene.lattice, np.zeros((cloak.scene.lattice.n_vertices, 3, 3))
    for (one, other), block in zip(lattice.ligaments, of_ligaments(cloak), strict=True):
        held[one] += block[:3, :3]
        held[other] += block[3:, 3:]
    out = []
    for unit, stiffness in enumerate(unit_stiffnesses(cloak)):
        grips = la.block_diag(*held[4 * unit : 4 * unit + 4])
        root = la.cholesky(grips + 1e-9 * np.eye(12))
        out.append(la.eigvalsh(root @ la.pinvh(stiffness, rtol=1e-9) @ root.T)[-1])
    return np.array(out)


def test_beams_tell_soft_units_as_elements_do(cloak: Cloak) -> None:
    material = cloak.scene.structure.material
    lattice, vertices = cloak.scene.lattice, cloak.vertices
    beams = compliance_shares(lattice, vertices, material, MODULUS, THICKNESS)
    ratio = beams / (truth := shares_by_elements(cloak))
    assert 0.5 < truth.max() < SOFT
    assert ratio[truth.argmax()] == pytest.approx(1.0, abs=0.1)
    assert 0.2 < ratio.min() < ratio.max() < 2.0
    assert ratio[truth > 0.25].min() > 0.6
