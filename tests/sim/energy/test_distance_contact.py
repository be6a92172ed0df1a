"""Contact on the distance of units: the law, and the compiled kernels against its derivatives."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import given, settings
from hypothesis import strategies as st
from jax import Array

import sim
from benchmarks.scenes import MATERIAL
from sim.collision import ContactArrays, collision_free_step
from sim.collision.neighbour_list import find
from sim.collision.step_limit import FAR
from sim.core import Floats, Numbers
from sim.energy import (
    DistanceLaw,
    Sensitivity,
    System,
    Topology,
    UnitOutline,
    distance_contact_kernels,
    pair_energy,
    system_of,
    topology,
)
from sim.energy.distance_contact import barrier, edge_energy, vertices_energy
from sim.energy.network_arrays import Kinematics
from sim.linalg import clear, matrix, number_free_dofs
from sim.structure import clearance, displaced
from sim.structure.gaps import polygons
from tests.sim.structures import assert_equal, at_rest, dense, hand_made
from tests.tables import some

EXACT = 1e-12
REACH = 0.8
LAW = DistanceLaw(float(MATERIAL.contact_stiffness) * (REACH / 2.0) ** 2, REACH)


def ring(rng: np.random.Generator, n: int, size: float) -> Floats:
    """A star-shaped polygon around the origin, counter-clockwise, not always convex."""
    angles = 2 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    lengths = size * rng.uniform(0.7, 1.3, n)
    return lengths[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)


class Crowd(NamedTuple):
    """Units side by side, a small way apart, none of them joined but the first two."""

    lattice: sim.Lattice
    system: System
    motion: Floats
    direction: Floats

    @property
    def contacts(self) -> ContactArrays:
        return self.system.contacts


def crowd(seed: int) -> Crowd:
    """Four random units in a random state, each pushed against the first until it is near."""
    rng = np.random.default_rng(seed)
    rings = [ring(rng, 5, 5.0) for _ in range(4)]
    sites = 15.0 * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    lattice = hand_made([r + s for r, s in zip(rings, sites, strict=True)], np.array([[0, 7]]))
    motion = np.zeros((4, 3))
    motion[:, 2] = rng.normal(size=4)
    for unit in (1, 2, 3):
        motion[unit, :2] = -approach(lattice, motion, unit, sites[unit] / 15.0, rng)
    system = system_of(_topology(lattice), at_rest(lattice))
    return Crowd(lattice, system, motion.ravel(), rng.normal(size=12))


def _topology(lattice: sim.Lattice) -> Topology:
    return topology(lattice, np.array([], dtype=np.int64), sim.DistanceContact(REACH))


def approach(
    lattice: sim.Lattice, motion: Floats, unit: int, away: Floats, rng: np.random.Generator
) -> Floats:
    """Where to push a unit so that a random small gap to the first one is left."""
    wanted, near, far = rng.uniform(0.2, 0.9) * REACH, 0.0, 30.0
    for _ in range(40):
        middle = (near + far) / 2
        moved = motion.copy()
        moved[unit, :2] = -middle * away
        first, other = polygons(lattice, displaced(lattice, lattice.vertices, moved))[[0, unit]]
        near, far = (middle, far) if first.distance(other) > wanted else (near, middle)
    return near * away


class Differentiable(NamedTuple):
    """What the contact energy depends on besides the motion."""

    corner: Numbers
    centroid: Numbers
    stiffness: Numbers
    scale: float


def numbers(case: Crowd) -> Differentiable:
    contacts = case.contacts
    scale = contacts.per_stiffness
    return Differentiable(
        contacts.corner, contacts.centroid, np.array([MATERIAL.contact_stiffness]), scale
    )


PAIRS = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


def definition(motion: Numbers, parts: Differentiable) -> Array:
    law = DistanceLaw(jnp.mean(parts.stiffness) * parts.scale, REACH)
    units = UnitOutline(jnp.asarray(parts.centroid), jnp.asarray(parts.corner).reshape(4, -1, 2))
    motions = jnp.asarray(motion).reshape(-1, 3)

    def pair(a: Array, b: Array) -> Array:
        one, other = (UnitOutline(units.centroid[k], units.corner[k]) for k in (a, b))
        return pair_energy(motions[a], motions[b], one, other, law)

    return jax.vmap(pair)(*PAIRS.T).sum()


of_definition = jax.jit(jax.value_and_grad(definition))
hessian_of_definition = jax.jit(jax.hessian(definition))


@jax.jit
def mixed_of_definition(
    motion: Numbers, parts: Differentiable, direction: Numbers
) -> Differentiable:
    def along(parts: Differentiable) -> Array:
        return jnp.dot(jax.grad(definition)(motion, parts), direction)

    return jax.grad(along)(parts)


@pytest.fixture(scope="module", params=some(range(6), 1))
def case(request: pytest.FixtureRequest) -> Crowd:
    return crowd(request.param)


def test_energy_and_gradient(case: Crowd) -> None:
    out = np.zeros(12)
    energy = distance_contact_kernels.add_gradient(case.motion, case.contacts, out)
    assert energy > 0
    wanted, slope = of_definition(case.motion, numbers(case))
    assert energy == pytest.approx(float(wanted), rel=EXACT)
    assert_equal(out, slope)


def test_tangent_and_product(case: Crowd) -> None:
    hessian = np.asarray(hessian_of_definition(case.motion, numbers(case)))
    product = np.zeros(12)
    distance_contact_kernels.add_hessian_product(
        case.motion, case.contacts, case.direction, product
    )
    assert_equal(product, hessian @ case.direction)

    held = np.array([1, 5])
    free, pattern = number_free_dofs(case.lattice.site, case.contacts.pairs, held)
    tangent = matrix(pattern)
    clear(tangent)
    distance_contact_kernels.add_tangent(case.motion, case.contacts, free, tangent)
    order = np.argsort(free)[2:]
    assert_equal(dense(tangent), hessian[np.ix_(order, order)])


def test_mixed_derivatives(case: Crowd) -> None:
    motion, direction = case.motion, case.direction
    zero = np.zeros(0)
    contacts = case.contacts
    out = Sensitivity(
        zero, zero, zero, zero, zero, np.zeros(1), np.zeros_like(contacts.corner), np.zeros((4, 2))
    )
    turn = motion[2::3]
    parts = [np.cos(turn), np.sin(turn), np.cos(turn / 2), np.sin(turn / 2)]
    kinematics = Kinematics(np.stack(parts, axis=1), zero)
    distance_contact_kernels.add_mixed(motion, contacts, kinematics, direction, out)

    wanted = mixed_of_definition(motion, numbers(case), direction)
    assert_equal(out.corner, wanted.corner)
    assert_equal(out.centroid, wanted.centroid)
    assert_equal(out.contact, wanted.stiffness)


@pytest.mark.parametrize("seed", range(6))
def test_units_in_contact_are_found_whatever_state_came_before(seed: int) -> None:
    """Pairs that cannot have met since the last search are skipped: by small steps and leaps."""
    case, rng = crowd(seed), np.random.default_rng(seed)
    state, found = case.motion, 0
    for step in (*np.full(20, 0.02), 3.0, *np.full(20, 0.05), 0.5, 0.5):
        state = state + step * rng.normal(size=12) * np.tile([1.0, 1.0, 0.2], 4)
        fresh = system_of(_topology(case.lattice), at_rest(case.lattice)).contacts
        count, alone = find(state, case.contacts), find(state, fresh)
        assert count == alone
        np.testing.assert_array_equal(
            case.contacts.cache.terms[: max(count, 0)], fresh.cache.terms[: max(alone, 0)]
        )
        found += count > 0
        if count < 0:
            state = case.motion
    assert found > 0


pair = jax.jit(lambda a, b, one, other: pair_energy(a, b, one, other, LAW))
STILL = np.zeros(3)


def near(seed: int, gap: float) -> tuple[UnitOutline, UnitOutline, Floats]:
    """Two random units, and the motion of the second that leaves so small a gap to the first."""
    rng = np.random.default_rng(seed)
    rings = [ring(rng, 5, 5.0), ring(rng, 5, 5.0)]
    angle = rng.uniform(0, 2 * np.pi)
    towards = np.array([np.cos(angle), np.sin(angle)])
    first, second = (shapely.Polygon(r) for r in rings)

    def distance(along: float) -> float:
        return float(first.distance(shapely.affinity.translate(second, *(along * towards))))

    low, high = 0.0, 30.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if distance(middle) > gap else (middle, high)
    zero = np.zeros(2)
    return (
        UnitOutline(zero, rings[0]),
        UnitOutline(zero, rings[1]),
        np.array([*(high * towards), 0.0]),
    )


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.floats(1.0001, 1.5))
def test_there_is_no_contact_beyond_the_activation_distance(seed: int, share: float) -> None:
    one, other, motion = near(seed, share * REACH)
    assert float(pair(STILL, motion, one, other)) == 0.0


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.02, 0.9))
def test_within_it_there_is_wherever_units_are_closest(seed: int, share: float) -> None:
    """At least a part of the barrier at that distance: the weight dips next to an edge's end."""
    one, other, motion = near(seed, share * REACH)
    alone = float(barrier(jnp.asarray((share * REACH) ** 2), LAW))
    assert float(pair(STILL, motion, one, other)) > 0.04 * alone


@pytest.mark.parametrize("seed", range(10))
def test_the_energy_has_no_bound_at_a_touch(seed: int) -> None:
    """It grows at least as the power -4/5 of the distance."""
    closer = [near(seed, gap * REACH) for gap in (1e-2, 1e-3, 1e-4, 1e-5)]
    energies = [float(pair(STILL, motion, one, other)) for one, other, motion in closer]
    assert (np.diff(energies) > 0.0).all()
    assert energies[-1] > 1e3**0.75 * energies[0]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.floats(-100.0, 100.0), st.floats(-3.0, 3.0))
def test_moving_both_units_as_one_changes_nothing(seed: int, shift: float, turn: float) -> None:
    one, other, motion = near(seed, 0.3 * REACH)
    c, s = np.cos(turn), np.sin(turn)
    x, y, theta = motion
    moved = np.array([c * x - s * y + shift, s * x + c * y, theta + turn])
    whole = float(pair(np.array([shift, 0.0, turn]), moved, one, other))
    assert whole == pytest.approx(float(pair(STILL, motion, one, other)), rel=1e-10)


@jax.jit
def curvature(vertex: Array, edge: Array) -> Array:
    """Second derivatives (6, 6) of the energy of a vertex with an edge and its two ends."""

    def energy(points: Array) -> Array:
        v, p, q = points.reshape(3, 2)
        ends = vertices_energy(v, p, LAW) + vertices_energy(v, q, LAW)
        return ends + edge_energy(v, p, q, LAW)

    return jax.hessian(energy)(jnp.concatenate([vertex, edge.ravel()]))


@pytest.mark.parametrize(
    ("place", "across"),
    [
        ((0.0, 0.3), (1.0, 0.0)),
        ((REACH, 0.3), (1.0, 0.0)),
        ((5.0 - REACH, 0.3), (1.0, 0.0)),
        ((5.0, 0.3), (1.0, 0.0)),
        ((2.5, REACH), (0.0, 1.0)),
        ((-0.6 * REACH, 0.8 * REACH), (0.6, -0.8)),
    ],
)
def test_curvature_does_not_jump(place: tuple[float, float], across: tuple[float, float]) -> None:
    """Where the nearest feature, the fading or the contact itself begins and ends."""
    edge = np.array([[5.0, 0.0], [0.0, 0.0]])  # its outside is above
    here = [
        np.asarray(curvature(np.array(place) + step * np.array(across), edge))
        for step in (-1e-7, 1e-7)
    ]
    size = np.abs(np.asarray(curvature(np.array([2.5, 0.3]), edge))).max()
    assert np.abs(here[1] - here[0]).max() < 1e-4 * size


@pytest.mark.parametrize("seed", some(range(30), 10))
def test_no_units_meet_within_the_step_limit(seed: int) -> None:
    """And the limit is not far below the first meeting, found by small steps."""
    case = crowd(seed % 6)
    step = np.random.default_rng(seed).normal(size=12) * np.tile([2.0, 2.0, 0.5], 4)
    limit = min(collision_free_step(case.motion, case.contacts, step), FAR)
    multiples = np.linspace(0.0, FAR, 401)
    states = case.motion + multiples[:, None] * step
    overlaps = clearance(case.lattice, case.lattice.vertices, states.reshape(-1, 4, 3)).overlaps
    meeting = multiples[overlaps > 0]
    first = meeting[0] if len(meeting) else FAR
    assert limit <= first
    assert limit >= 0.8 * (first - multiples[1])
