from typing import Literal

import jax.numpy as jnp
import numpy as np
import pytest

import sim
from sim.core import Floats
from sim.energy import ligament_strain, topology
from sim.quasistatics import StaticSolver
from sim.scene import as_built, relaxed
from tests.sim.structures import taylor_orders
from tests.tables import some

PLAIN = sim.Material(6.18e-9, 120.0, 1.19, 1.5, 1.5, 1e-8, 1e-7)


def scene(
    material: sim.Material, motion: sim.MotionLaw | None = None, static: bool = True
) -> sim.Scene:
    """Four by three squares, the left column clamped, the right one pulled."""
    lattice = sim.quads(4, 3, 15.0, 2.25, np.deg2rad(20.0))
    right, left = np.array([3, 7, 11]), np.array([0, 4, 8])
    law = sim.LinearRamp(-1.0, 1.0, 0.0) if motion is None else motion
    loads = sim.Loads(
        (sim.PrescribedMotion(right, law),), (sim.Clamp(left),), static=static, duration=1.0
    )
    return sim.Scene(sim.Structure(lattice, material), loads)


STEPS = np.array([1e-2, 5e-3, 2.5e-3])


def bent(size: float = 0.3) -> sim.Material:
    rng = np.random.default_rng(3)
    n = sim.quads(4, 3, 15.0, 2.25, 0.3).n_ligaments
    return PLAIN._replace(
        end_angles=size * rng.normal(size=(n, 2)), elongation=0.02 * rng.normal(size=n)
    )


def test_a_strip_is_free_of_stress_once_its_clamps_are_in_line() -> None:
    a, b = 0.3, -0.1
    made = sim.concrete_parameters(
        scene(PLAIN._replace(end_angles=np.array([a, b]))), scene(PLAIN).lattice.vertices
    )
    vector, still = jnp.array([2.25, 0.0]), jnp.zeros(3)
    # the second unit turns so that its clamp is parallel to the first's, and moves onto its line
    there = 2.25 * np.array([np.cos(a), np.sin(a)])
    motion = jnp.array([*(there - np.asarray(vector)), a - b])
    strain = ligament_strain(still, motion, jnp.zeros(2), jnp.zeros(2), vector)
    assert np.array(strain) == pytest.approx(made.natural[0], abs=1e-15)


def test_without_a_natural_state_nothing_changes_by_a_bit() -> None:
    zeros = PLAIN._replace(end_angles=np.zeros((17, 2)), elongation=np.zeros(17))
    one, other = sim.simulate(scene(PLAIN)), sim.simulate(scene(zeros))
    assert np.array_equal(one.displacement, other.displacement)
    at_rest = relaxed(scene(PLAIN))
    assert np.array_equal(at_rest.motion, np.zeros((12, 3)))


@pytest.mark.parametrize("static", [True, False], ids=["static", "in time"])
def test_a_relaxed_structure_rests_and_answers_as_the_one_it_was(static: bool) -> None:
    """A path from the design, less the motion at its start, is the path from rest."""
    plain = scene(bent())
    at_rest = relaxed(plain)
    assert np.abs(at_rest.motion[:, 2]).max() > 0.01
    again = relaxed(at_rest.scene)
    assert np.abs(again.motion).max() < 1e-9
    if static:
        path, moved = (
            sim.simulate(each, times=np.array([0.5, 1.0])) for each in (plain, at_rest.scene)
        )
        from_rest = np.asarray(path.displacement) - at_rest.motion
        np.testing.assert_allclose(moved.displacement, from_rest, atol=1e-8)
        np.testing.assert_allclose(moved.drive_force, path.drive_force, rtol=1e-7)
        strained = [each.observables[0].strain_energy for each in (path, moved)]
        np.testing.assert_allclose(strained[0], strained[1], rtol=1e-8)
    else:
        shaken = at_rest.scene.updated(
            cases=(sim.PrescribedMotion(plain.loads.driven, sim.Harmonic(0.0, 5.0, 0.0)),),
            static=False,
        )
        assert (
            np.abs(sim.simulate(shaken, times=np.linspace(0.0, 0.1, 5)).displacement).max() < 1e-8
        )


def test_derivatives_by_the_natural_state_pass_the_taylor_test() -> None:
    posed = scene(bent())
    values = sim.concrete_parameters(posed, posed.lattice.vertices)
    joined = topology(posed.lattice, posed.loads.held, posed.structure.contact)
    solver = StaticSolver(joined, np.array([0.5, 1.0]), relative=1e-13)
    rng = np.random.default_rng(5)
    way = values._replace(
        **{name: np.zeros_like(part) for name, part in values._asdict().items()}
    )._replace(natural=rng.normal(size=values.natural.shape) * [0.05, 0.2, 0.3])
    weight = rng.normal(size=(2, 36))

    def value(step: float) -> float:
        shifted = values._replace(natural=values.natural + step * way.natural)
        return float((solver.forward(shifted, posed.loads.cases[0])[0] * weight).sum())

    _, _, record = solver.forward(values, posed.loads.cases[0])
    bar: Floats = solver.backward(values, record, weight, np.zeros_like(weight))[0].natural
    slope = float((bar * way.natural).sum())
    np.testing.assert_allclose(taylor_orders(value, slope, STEPS), 2.0, atol=0.1)


def pulled(kind: Literal["displacement", "strain_energy"]) -> sim.Scene:
    """The squares, two in the middle of which are to rest."""
    return scene(PLAIN).updated(region=np.array([5, 6]), kind=kind, steps=2)


@pytest.mark.parametrize("kind", ["displacement", "strain_energy"])
def test_straight_shims_change_no_loss(kind: Literal["displacement", "strain_energy"]) -> None:
    posed = pulled(kind)
    found = as_built(posed, posed.lattice.vertices, np.zeros((17, 2)))
    assert np.abs(found.turn).max() == 0.0
    assert found.loss_as_built == pytest.approx(found.loss_as_designed, rel=1e-9)
    assert found.loss_as_designed > 0.0


def test_a_bent_shim_turns_units_and_only_what_loads_add_counts() -> None:
    posed, angles = pulled("strain_energy"), np.zeros((17, 2))
    angles[4] = 0.3, -0.3
    found = as_built(posed, posed.lattice.vertices, angles)
    assert 0.01 < np.degrees(np.abs(found.turn).max()) < 20.0
    assert abs(found.loss_as_built / found.loss_as_designed - 1.0) > 1e-3
    assert 0.0 < found.loss_as_built < 3.0 * found.loss_as_designed


def test_a_symmetric_design_is_built_with_shims_that_are_not() -> None:
    lattice = sim.quads(5, 5, 15.0, 2.25, np.deg2rad(20.0))
    loads = sim.Loads(
        (sim.PrescribedMotion(np.array([12]), sim.LinearRamp(0.5, 1.0, 0.0)),),
        (sim.Clamp(np.array([0, 4, 20, 24])),),
        static=True,
        duration=1.0,
    )
    posed = sim.Scene(sim.Structure(lattice, PLAIN), loads).updated(
        region=np.array([2]), steps=2, cloak=np.array([7, 11, 13, 17]), symmetry="C4"
    )
    assert posed.space.n_variables < 8
    angles = np.random.default_rng(4).normal(size=(lattice.n_ligaments, 2)) * 0.1
    assert as_built(posed, lattice.vertices, angles).loss_as_built > 0.0


def turning(kind: Literal["displacement", "strain_energy"], **changes: object) -> sim.Scene:
    """The squares, whose middle is redesigned with the slots that hold its ligaments."""
    return pulled(kind).updated(cloak=np.array([5, 6]), turning_slots=True, **changes)


@pytest.mark.parametrize("kind", some(["strain_energy", "displacement"], 1))
@pytest.mark.parametrize("static", [True, False], ids=["static", "in time"])
def test_designs_with_turned_slots_are_those_built_and_pass_the_taylor_test(
    kind: Literal["displacement", "strain_energy"], static: bool
) -> None:
    posed = turning(kind)
    if not static:
        shaken = sim.PrescribedMotion(posed.loads.driven, sim.Harmonic(1.0, 5.0, 0.0))
        posed = posed.updated(cases=(shaken,), static=False, steps=None, samples=21, duration=0.2)
    rng = np.random.default_rng(4)
    design, way = rng.normal(size=(2, posed.space.n_variables))
    plan = sim.make_plan(posed)
    loss, gradient = sim.evaluate(posed, design, plan)
    plain = posed.updated(turning_slots=False)
    angles = np.asarray(posed.space.end_angles(design))
    assert np.abs(angles).max() > 0.2
    built = as_built(plain, np.asarray(posed.space.vertices(design)), angles)
    assert loss == pytest.approx(built.loss_as_built, rel=1e-8 if static else 1e-3)
    orders = taylor_orders(
        lambda step: sim.evaluate(posed, design + step * way, plan)[0], gradient @ way, STEPS
    )
    np.testing.assert_allclose(orders, 2.0, atol=0.15)


def test_turned_slots_move_ligaments_far_from_the_design() -> None:
    lattice = sim.quads(7, 5, 15.0, 2.25, np.deg2rad(20.0))
    left = np.arange(0, 35, 7)
    pull = sim.PrescribedMotion(left + 6, sim.LinearRamp(-1.0, 1.0, 0.0))
    loads = sim.Loads((pull,), (sim.Clamp(left),), static=True, duration=1.0)
    posed = sim.Scene(sim.Structure(lattice, PLAIN), loads).updated(
        region=np.array([18, 19]), steps=2, cloak=np.array([15, 16]), turning_slots=True
    )
    rng = np.random.default_rng(4)
    design, way = rng.normal(size=(2, posed.space.n_variables))
    plan = sim.make_plan(posed)
    _, gradient = sim.evaluate(posed, design, plan)
    orders = taylor_orders(
        lambda step: sim.evaluate(posed, design + step * way, plan)[0], gradient @ way, STEPS
    )
    np.testing.assert_allclose(orders, 2.0, atol=0.15)


@pytest.mark.parametrize("symmetry", ["C4", "mirror_x", "mirror_y"])
def test_slots_turn_as_the_symmetry_asks_for(symmetry: Literal["C4", "mirror_x"]) -> None:
    """A structure with them comes to rest in a state of that symmetry."""
    lattice = sim.quads(5, 5, 15.0, 2.25, np.deg2rad(20.0 if symmetry == "C4" else 0.0))
    middle, corners = np.array([12]), np.array([0, 4, 20, 24])
    still = sim.PrescribedMotion(middle, sim.LinearRamp(0.0, 1.0, 0.0))
    loads = sim.Loads((still,), (sim.Clamp(corners),), static=True, duration=1.0)
    posed = sim.Scene(sim.Structure(lattice, PLAIN), loads).updated(
        region=np.array([2]), cloak=np.arange(25), symmetry=symmetry, turning_slots=True
    )
    design = np.random.default_rng(5).normal(size=posed.space.n_variables)
    material = PLAIN._replace(end_angles=np.asarray(posed.space.end_angles(design)))
    vertices = np.asarray(posed.space.vertices(design))
    motion = relaxed(posed.updated(material=material, turning_slots=False), vertices).motion
    field = motion.reshape(5, 5, 3)
    image = {
        "C4": np.stack([field[..., 1], -field[..., 0], field[..., 2]], -1)[:, ::-1].swapaxes(0, 1),
        "mirror_x": field[:, ::-1] * [-1.0, 1.0, -1.0],
        "mirror_y": field[::-1] * [1.0, -1.0, -1.0],
    }[symmetry]
    assert np.abs(motion[:, 2]).max() > 0.01
    np.testing.assert_allclose(image, field, atol=1e-7)
