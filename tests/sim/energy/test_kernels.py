"""The compiled kernels against the automatic derivatives of the law's definition."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from benchmarks.scenes import BARRIER, CUTOFF
from sim.core import Floats, Ints, Numbers
from sim.energy import (
    ContactLaw,
    LigamentLaw,
    Sensitivity,
    contact_energy,
    contact_void_angles,
    ligament_energy,
    ligament_kernels,
    void_contact_kernels,
)
from sim.energy.network_arrays import Kinematics, NetworkArrays
from sim.linalg import Storage, block_entries, clear, matrix, number_free_dofs
from sim.structure import Lattice, quads, shape
from tests.sim.structures import assert_equal, dense, mixed_polygons

EXACT = 1e-12


class Case(NamedTuple):
    """A random network in a random state far from rest, a third of whose voids are in contact."""

    lattice: Lattice
    net: NetworkArrays
    motion: Floats
    direction: Floats


def case(lattice: Lattice, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    shifts = rng.uniform(-1.5, 1.5, (lattice.n_groups, 2))
    made = shape(lattice, lattice.vertices + shifts[lattice.group])
    n = lattice.n_ligaments
    motion = rng.normal(size=(lattice.n_units, 3)) * [1.0, 1.0, 0.7]
    a, b = lattice.ligament_units.T
    turn = motion[a, 2] - motion[b, 2]
    current = np.deg2rad(rng.uniform(-8.0, 200.0, (n, 2)))
    closing = rng.permutation(n)[: max(2, n // 3)]
    current[closing, rng.integers(0, 2, len(closing))] = np.deg2rad(
        rng.uniform(-14.5, -10.5, len(closing))
    )
    contact = np.tile([0.0, BARRIER, CUTOFF], (n, 1))
    contact[:, 0] = rng.uniform(1.0, 2.0, n)
    net = NetworkArrays(
        unit=np.ascontiguousarray(lattice.ligament_units),
        arm=np.asarray(made.arm)[lattice.ligaments],
        vector=lattice.ligament_vectors + rng.normal(size=(n, 2)) * 0.2,
        void=current - np.stack([turn, -turn], axis=1),
        law=rng.uniform(0.5, 1.5, (n, 3)) * [120.0, 1.19, 1.5],
        natural=rng.normal(size=(n, 3)) * [0.1, 0.3, 0.5],
        contact=contact,
        touching=np.arange(n),
    )
    return Case(lattice, net, motion.ravel(), rng.normal(size=motion.size))


@pytest.fixture(
    scope="module",
    params=[
        (lambda: quads(4, 3, 15.0, 2.25, np.deg2rad(20.0)), 0),
        (lambda: quads(4, 3, 15.0, 2.25, np.deg2rad(-5.0)), 1),
        (mixed_polygons, 2),
    ],
    ids=["squares", "other squares", "mixed polygons"],
)
def random_case(request: pytest.FixtureRequest) -> Case:
    build, seed = request.param
    return case(build(), seed)


class Differentiable(NamedTuple):
    """The numbers that a network's energy depends on, besides the motion."""

    arm: Numbers
    vector: Numbers
    void: Numbers
    law: Numbers
    natural: Numbers
    stiffness: Numbers


def numbers(net: NetworkArrays) -> Differentiable:
    return Differentiable(net.arm, net.vector, net.void, net.law, net.natural, net.contact[:, 0])


def definition(motion: Numbers, parts: Differentiable, unit: Ints) -> Array:
    """Energy of the network, summed from the law of one ligament and of one contact."""
    arm, vector, void, law, natural, stiffness = map(jnp.asarray, parts)
    of_units = jnp.asarray(motion).reshape(-1, 3)
    a, b = of_units[unit[:, 0]], of_units[unit[:, 1]]

    def ligament(
        a: Array, b: Array, arm: Array, vector: Array, law: Array, natural: Array
    ) -> Array:
        return ligament_energy(a, b, arm[0], arm[1], vector, LigamentLaw(*law), natural)

    def contact(a: Array, b: Array, void: Array, stiffness: Array) -> Array:
        angles = contact_void_angles(void, a[2], b[2])
        return contact_energy(angles, ContactLaw(stiffness, BARRIER, CUTOFF)).sum()

    strain = jax.vmap(ligament)(a, b, arm, vector, law, natural)
    return strain.sum() + jax.vmap(contact)(a, b, void, stiffness).sum()


gradient_of_definition = jax.jit(jax.grad(definition))
hessian_of_definition = jax.jit(jax.hessian(definition))


@jax.jit
def mixed_of_definition(
    motion: Numbers, parts: Differentiable, unit: Ints, direction: Numbers
) -> Differentiable:
    def along(parts: Differentiable) -> Array:
        return jnp.dot(jax.grad(definition)(motion, parts, unit), direction)

    return jax.grad(along)(parts)


def located(motion: Floats, net: NetworkArrays) -> Kinematics:
    kinematics = Kinematics(np.empty((len(motion) // 3, 4)), np.empty(len(net.unit)))
    ligament_kernels.locate(motion, net, kinematics)
    return kinematics


def gradient(motion: Floats, net: NetworkArrays) -> tuple[float, float, Floats]:
    """Strain and contact energy, and the gradient of their sum."""
    force, kinematics = np.empty(len(motion)), located(0.0 * motion, net)
    strain = ligament_kernels.gradient(motion, net, kinematics, force)
    for one, other in zip(kinematics, located(motion, net), strict=True):
        np.testing.assert_array_equal(one, other)
    return strain, void_contact_kernels.add_gradient(motion, net, force), force


def test_energy_and_gradient(random_case: Case) -> None:
    net, motion = random_case.net, random_case.motion
    strain, contact, force = gradient(motion, net)
    assert 0 < contact < np.inf
    wanted = float(definition(motion, numbers(net), net.unit))
    assert strain + contact == pytest.approx(wanted, rel=EXACT)
    assert_equal(force, np.asarray(gradient_of_definition(motion, numbers(net), net.unit)))


@pytest.mark.parametrize("storage", ["band", "panels", "fronts"])
def test_tangent(random_case: Case, storage: Storage) -> None:
    net, motion, lattice = random_case.net, random_case.motion, random_case.lattice
    held = np.array([0, 1, 2, 7])
    free, pattern = number_free_dofs(lattice.site, net.unit, held, (storage,))
    made = matrix(pattern)
    clear(made)
    entries = block_entries(pattern, free, net.unit)
    ligament_kernels.tangent(motion, net, located(motion, net), entries, made.values)
    void_contact_kernels.add_tangent(motion, net, free, made)
    order = np.argsort(free)[len(held) :]
    wanted = np.asarray(hessian_of_definition(motion, numbers(net), net.unit))
    assert_equal(dense(made), wanted[np.ix_(order, order)])


def test_hessian_product(random_case: Case) -> None:
    net, motion = random_case.net, random_case.motion
    kinematics, product = located(motion, net), np.empty(len(motion))
    ligament_kernels.hessian_product(motion, net, kinematics, random_case.direction, product)
    void_contact_kernels.add_hessian_product(motion, net, random_case.direction, product)
    hessian = np.asarray(hessian_of_definition(motion, numbers(net), net.unit))
    assert_equal(product, hessian @ random_case.direction)


def test_mixed_derivatives(random_case: Case) -> None:
    found = mixed(random_case, np.arange(len(random_case.net.unit)))
    wanted = mixed_of_definition(
        random_case.motion, numbers(random_case.net), random_case.net.unit, random_case.direction
    )
    for one, other in zip(found[: len(wanted)], wanted, strict=True):
        assert_equal(one, np.asarray(other))
    some = np.array([1, 4])
    every = mixed(random_case, np.arange(len(random_case.net.unit)))
    chosen = mixed(random_case, some)
    for all_of_it, part in zip(every[:6], chosen[:6], strict=True):
        np.testing.assert_array_equal(part[some], all_of_it[some])
        assert np.count_nonzero(part) <= all_of_it[some].size


def mixed(of: Case, which: Ints) -> Sensitivity:
    net = of.net
    parts = (net.arm, net.vector, net.void, net.law, net.natural, net.contact[:, 0])
    none = np.zeros((0, 2))
    out = Sensitivity(*(np.zeros(part.shape) for part in (*parts, none, none)))
    ligament_kernels.mixed(of.motion, net, located(of.motion, net), of.direction, which, out)
    void_contact_kernels.add_mixed(of.motion, net, of.direction, which, out)
    return out


def room(motion: Floats, net: NetworkArrays) -> float:
    """Smallest distance of a void angle from the barrier, rad."""
    a, b = motion.reshape(-1, 3)[net.unit].swapaxes(0, 1)[..., 2]
    return float(min((net.void[:, 0] + a - b).min(), (net.void[:, 1] - a + b).min()) - BARRIER)


def test_the_step_to_the_barrier(random_case: Case) -> None:
    net, motion, direction = random_case.net, random_case.motion, random_case.direction
    multiple = void_contact_kernels.barrier_step(motion, net, direction)
    assert abs(room(motion + multiple * direction, net)) < 1e-12
    assert room(motion + 0.99 * multiple * direction, net) > 0
    assert gradient(motion + 1.01 * multiple * direction, net)[1] == np.inf
    still = np.zeros_like(direction)
    assert void_contact_kernels.barrier_step(motion, net, still) == np.inf


@pytest.mark.parametrize("side", [0, 1])
def test_contact_begins_at_the_cutoff(random_case: Case, side: int) -> None:
    """A hair above it there is none, a hair below there is what the definition has."""
    net, sign = random_case.net, 1.0 - 2.0 * side
    law = ContactLaw(net.contact[0, 0], BARRIER, CUTOFF)
    for off in (1e-2, 1e-4, 1e-6, 0.0, -1e-6, -1e-4, -1e-2):
        turn = sign * (CUTOFF + off - net.void[0, side])
        energy, slope, curvature = void_contact_kernels.void_slopes(net, 0, side, turn)
        if off > 0:
            assert energy == slope == curvature == 0.0
        wanted = float(contact_energy(CUTOFF + off, law))
        assert energy == pytest.approx(wanted, rel=1e-6, abs=1e-18)
