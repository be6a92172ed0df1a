from collections.abc import Callable
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.scenes import BARRIER, CUTOFF
from sim.core import Floats
from sim.energy import (
    ContactLaw,
    LigamentLaw,
    contact_energy,
    ligament_energy,
    ligament_kernels,
    topology,
    void_contact_kernels,
)
from sim.energy.ligament import ligament_strain
from sim.energy.network_arrays import Kinematics, NetworkArrays
from sim.energy.observables import observe
from sim.scene import concrete_parameters
from sim.structure import Lattice, VoidAngleContact, shape
from tests.sim.reference_scenes import compressed, reference
from tests.sim.structures import NONE, at_rest, mixed_polygons, rotating_squares, some_ligaments

LAW = ContactLaw(1.5, BARRIER, CUTOFF)
Build = Callable[[], Lattice]


@cache
def network(build: Build) -> tuple[NetworkArrays, Floats]:
    """Kernel arrays of a lattice at rest, and its centroids."""
    lattice = build()
    top = topology(lattice, NONE, VoidAngleContact(BARRIER, CUTOFF))
    return top.network(at_rest(lattice)), np.asarray(shape(lattice, lattice.vertices).centroid)


def energy(motion: Floats, net: NetworkArrays) -> tuple[float, float]:
    n_units, n_ligaments = len(motion) // 3, len(net.unit)
    kinematics, force = Kinematics(np.empty((n_units, 4)), np.empty(n_ligaments)), 0.0 * motion
    strain = ligament_kernels.gradient(motion, net, kinematics, force)
    return strain, void_contact_kernels.add_gradient(motion, net, force)


def typical_energy(net: NetworkArrays, n_units: int) -> float:
    motion = np.random.default_rng(0).normal(size=(n_units, 3)) * [1.0, 1.0, 0.1]
    return energy(motion.ravel(), net)[0]


@pytest.mark.parametrize("build", [rotating_squares, mixed_polygons])
@given(
    angle=st.floats(-40.0, 40.0),
    shift=st.tuples(st.floats(-100.0, 100.0), st.floats(-100.0, 100.0)),
)
def test_rigid_motions_cost_no_energy(build: Build, angle: float, shift: Floats) -> None:
    """Turned by any angle, several times around too, and moved by any distance, as a whole."""
    net, centroid = network(build)
    c, s = np.cos(angle), np.sin(angle)
    moved = centroid @ np.array([[c, s], [-s, c]]) - centroid + shift
    motion = np.column_stack([moved, np.full(len(moved), angle)])
    strain, contact = energy(motion.ravel(), net)
    assert strain <= 1e-12 * typical_energy(net, len(centroid))
    assert contact == 0.0


def test_rigid_motions_cost_no_energy_in_the_definition_either() -> None:
    arm_a, arm_b, vector = jnp.array([6.0, -2.0]), jnp.array([-6.0, 2.5]), jnp.array([2.25, 0.0])
    span = arm_a + vector - arm_b
    for angle in np.linspace(-20.0, 20.0, 41):
        c, s = np.cos(angle), np.sin(angle)
        moved = jnp.array([[c, -s], [s, c]]) @ span - span
        a, b = jnp.array([0.0, 0.0, angle]), jnp.array([*moved, angle])
        found = ligament_energy(a, b, arm_a, arm_b, vector, LigamentLaw(120.0, 1.19, 1.5))
        assert found < 1e-25


def test_ligament_strains_are_the_papers() -> None:
    """Pure stretch, shear and bending of one ligament against their closed forms."""
    still, vector = jnp.zeros(3), jnp.array([2.0, 0.0])
    law = LigamentLaw(100.0, 3.0, 7.0)

    def of(motion: list[float]) -> float:
        zero = jnp.zeros(2)
        return float(ligament_energy(still, jnp.array(motion), zero, zero, vector, law))

    assert of([0.5, 0.0, 0.0]) == pytest.approx(0.5 * 100 * 0.5**2)
    sheared = np.arctan2(1.0, 2.0)
    stretched = np.hypot(1.0, 2.0) - 2.0
    assert of([0.0, 1.0, 0.0]) == pytest.approx(
        0.5 * 100 * stretched**2 + 0.5 * 3 * (2.0 * sheared) ** 2
    )
    assert of([0.0, 0.0, 0.4]) == pytest.approx(0.5 * 3 * (2.0 * 0.2) ** 2 + 0.5 * 7 * 0.4**2)


@given(angle_deg=st.floats(-14.999, -10.0))
def test_contact_is_the_authors_formula(angle_deg: float) -> None:
    angle = np.deg2rad(angle_deg)
    x = (angle - CUTOFF) / (CUTOFF - BARRIER)
    wanted = 1.5 / 4 * (CUTOFF - BARRIER) ** 2 * (1 / (x + 1) - 1 / (x - 1) - 2)
    assert float(contact_energy(angle, LAW)) == pytest.approx(wanted, rel=1e-9, abs=1e-14)


def test_contact_begins_without_a_jump_in_force_and_ends_at_the_barrier() -> None:
    slope = jax.grad(lambda angle: contact_energy(angle, LAW))
    assert float(contact_energy(CUTOFF, LAW)) == 0.0
    assert float(slope(CUTOFF + 1e-9)) == 0.0
    assert abs(float(slope(CUTOFF - 1e-9))) < 1e-8
    assert float(contact_energy(BARRIER + 1e-9, LAW)) > 1e3
    assert np.isinf(contact_energy(BARRIER, LAW))
    assert np.isinf(contact_energy(BARRIER - 1.0, LAW))


@pytest.mark.parametrize("opening_deg", [100.0, 179.9, 180.1, 250.0, 340.0, 700.0])
def test_a_void_opened_beyond_half_a_turn_is_no_contact(opening_deg: float) -> None:
    """Through an atan2 such a void reads as closed, in the authors' code."""
    net, centroid = network(rotating_squares)
    motion = np.zeros((len(centroid), 3))
    a, b = net.unit[0]
    motion[a, 2], motion[b, 2] = np.deg2rad(opening_deg) / 2, -np.deg2rad(opening_deg) / 2
    only = net._replace(touching=np.array([0]), void=np.full_like(net.void, np.deg2rad(720.0)))
    assert energy(motion.ravel(), only)[1] == 0.0


def test_energies_along_the_reference_path() -> None:
    """Strain and contact energy of the states that the paper's code went through."""
    scene, stored = compressed("B"), reference("B")
    net = scene.topology.network(concrete_parameters(scene, scene.lattice.vertices))
    found = [energy(state.ravel(), net) for state in stored["static_path_u"]]
    np.testing.assert_allclose(np.sum(found, axis=1), stored["static_path_energy_Nmm"], rtol=1e-12)
    assert found[-1] == pytest.approx((112.8736, 0.0342), abs=1e-4)
    region = some_ligaments(net, np.flatnonzero(stored["roi_bond_mask"]))
    in_region = energy(stored["static_path_u"][-1].ravel(), region)[0]
    assert in_region == pytest.approx(stored["static_path_roi_energy_Nmm"][-1], rel=1e-12)


def test_observables_are_those_of_each_state() -> None:
    """Energies of the kernels, reactions at held dofs alone, and one void below the cutoff."""
    lattice = rotating_squares()
    net, centroid = network(rotating_squares)
    top = topology(lattice, np.arange(3), VoidAngleContact(BARRIER, CUTOFF))
    motion = np.zeros((3, *centroid.shape[:1], 3))
    motion[1, :, :2] = 1e-2 * centroid
    a, b = net.unit[0]
    turn = (CUTOFF - 1e-3 - net.void[0, 0]) / 2
    motion[2, a, 2], motion[2, b, 2] = turn, -turn
    seen = observe(top, at_rest(lattice), motion)
    found = np.stack([seen.strain_energy, seen.contact_energy], axis=1)
    np.testing.assert_allclose(found, [energy(state.ravel(), net) for state in motion])
    assert found[1, 0] > 0.0 == found[1, 1]
    closed = np.stack([net.void[:, 0], net.void[:, 1]]) + [[1], [-1]] * np.subtract(
        *motion[2, net.unit.T, 2]
    )
    assert seen.contact_pairs.tolist() == [0, 0, int((closed < CUTOFF).any(axis=0).sum())]
    assert seen.contact_pairs[2] > 0
    assert np.isfinite(seen.reaction[:, 0]).all()
    assert np.isnan(seen.reaction[:, 1:]).all()


def test_a_state_is_observed_the_same_among_others() -> None:
    lattice = rotating_squares()
    top = topology(lattice, NONE, VoidAngleContact(BARRIER, CUTOFF))
    motion = np.random.default_rng(2).normal(0.0, 0.05, (5, lattice.n_units, 3))
    found = observe(top, at_rest(lattice), motion)
    alone = observe(top, at_rest(lattice), motion[-1:])
    for all_states, last in zip(found, alone, strict=True):
        np.testing.assert_array_equal(np.asarray(all_states)[-1:], last)


def test_largest_strains_are_those_of_the_law() -> None:
    """Of ligaments that are not free of stress at rest too; and of a state that is none, none."""
    lattice = rotating_squares()
    top = topology(lattice, NONE, VoidAngleContact(BARRIER, CUTOFF))
    motion = np.random.default_rng(3).normal(0.0, 0.05, (3, lattice.n_units, 3))
    natural = np.random.default_rng(4).normal(0.0, 0.1, (len(top.ligament_units), 3))
    values = at_rest(lattice)._replace(natural=natural)
    strains = jax.vmap(ligament_strain)
    seen = observe(top, values, motion)
    for n, state in enumerate(motion):
        ends = state[top.ligament_units]
        ligaments = values.arm[:, 0], values.arm[:, 1], values.vector
        stretch, shear, bend = strains(ends[:, 0], ends[:, 1], *map(jnp.asarray, ligaments))
        length = np.linalg.norm(values.vector, axis=1)
        for found, each in zip(
            (seen.stretch, seen.shear, seen.bend), (stretch / length, shear, bend), strict=True
        ):
            assert found[n] == pytest.approx(float(np.abs(each).max()), rel=1e-12)
    unknown = observe(top, values, np.full_like(motion, np.nan))
    assert np.isnan([unknown.stretch, unknown.shear, unknown.bend]).all()
