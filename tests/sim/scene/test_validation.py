from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest

import sim
from sim.core import Floats, Ints, Numbers
from sim.quasistatics import StaticSolver
from sim.scene import SceneError, check_scene
from sim.solvers import FORCE, FREE, MotionLaw, solve_case
from tests.sim.structures import LEFT, Rig, hand_made, pressed, rotating_squares, squeezed


def scene(motion: MotionLaw | None = None, **changes: Any) -> sim.Scene:  # noqa: ANN401
    made = pressed(3.0)
    return (made if motion is None else made.driven_by(motion)).updated(**changes)


def series(start: float = 0.0, times: tuple[float, ...] = (0.0, 0.5, 1.0)) -> sim.TimeSeries:
    return sim.TimeSeries(np.array(times), np.outer([start, 1.0, 2.0], [1.0, 0.0, 0.0]))


def pushed(motion: MotionLaw) -> sim.PrescribedMotion:
    """A force along x on the right column, whose units keep to their height and angle."""
    return sim.PrescribedMotion(LEFT + 4, motion, np.array([[FORCE, 0, 0]] * 5))


def crossed(unit: int) -> Floats:
    """Two neighbouring corners of a unit swapped."""
    vertices = rotating_squares().vertices.copy()
    vertices[4 * unit : 4 * unit + 2] = vertices[4 * unit + 1 : 4 * unit - 1 : -1][:2]
    return vertices


class Numeric(NamedTuple):
    """Computed in NumPy alone."""

    speed: float

    def __call__(self, times: Numbers) -> Numbers:
        return np.stack([0.0 * times, self.speed * times, 0.0 * times], axis=-1)


class Short(NamedTuple):
    """Of one component."""

    speed: float

    def __call__(self, times: Numbers) -> Numbers:
        return self.speed * times


class Own(NamedTuple):
    """A law as it should be."""

    speed: float

    def __call__(self, times: Numbers) -> Numbers:
        xp, still = times.__array_namespace__(), 0.0 * times
        return xp.stack([self.speed * times, still, still], axis=-1)


def ramped(times: Numbers) -> Numbers:
    return Own(-3.0)(times)


NOTHING: Any = 3.0
UNKNOWN: Any = ("uz",)
PULLED = sim.LinearRamp(1.0, 1.0, 0.3)
FORCES = np.full((5, 3), FORCE)
MOVING: dict[str, Any] = {"static": False, "frequency": 10.0, "steps": None, "samples": 3}
REFUSED: dict[str, tuple[sim.Scene, str, str]] = {
    "beyond": (scene(sim.LinearRamp(-400.0, 1.0)), "400 mm, further than", "drive.amplitude"),
    "far beyond": (scene(sim.LinearRamp(1e300, 1.0)), "further than", "drive.amplitude"),
    "shaken beyond": (scene(sim.Harmonic(90.0, 10.0), **MOVING), "90 mm", "drive.amplitude"),
    "a plain function": (scene(ramped), "moves by ramped, .* give sim.TimeSeries", "drive"),
    "a number for a law": (scene(NOTHING), "by float, which is no law of motion", "drive"),
    "in NumPy alone": (scene(Numeric(1.0)), "JAX cannot .*__array_namespace__", "drive"),
    "of one component": (
        scene(Short(1.0)), r"5 units by motions of the shape \(513,\) .* give ux, uy, theta",
        "drive",
    ),
    "of two components": (
        scene(sim.TimeSeries(np.array([0.0, 1.0]), np.zeros((2, 2)))), r"\(513, 2\)", "drive",
    ),
    "no supports": (scene(supports=()), "moves along as one; clamp", "supports"),
    "supports across": (scene(supports=(sim.Clamp(LEFT, ("uy",)),)), "moves along", "supports"),
    "supports across, by a sine": (
        scene(sim.LinearRamp(3.0, 1.0, np.pi), supports=(sim.Clamp(LEFT, ("uy",)),)),
        "moves along", "supports",
    ),
    "plates that slide": (  # on a rail at the left, and freely along the right edge
        scene(
            supports=(sim.Clamp(LEFT, ("ux", "theta")),),
            cases=(
                sim.PrescribedMotion(
                    LEFT + 4, sim.LinearRamp(-3.0, 1.0), np.array([[0, FREE, 0]] * 5)
                ),
            ),
        ),
        "against load case 0: it can move or turn as one", "supports",
    ),
    "unsorted": (scene(series(times=(0.0, 0.7, 0.5))), "do not ascend", "drive.file"),
    "twice": (scene(series(times=(0.0, 0.5, 0.5))), "do not ascend", "drive.file"),
    "too short": (scene(series(times=(0.0, 0.2, 0.9))), "from 0 to 0.9 s", "drive.file"),
    "too late": (scene(series(times=(0.1, 0.2, 1.0))), "from 0.1 to 1 s", "drive.file"),
    "jump": (scene(series(start=1.0), **MOVING), "starts with a jump, of 0.5", "drive.file"),
    "a push at its peak": (
        scene(cases=(pushed(sim.Pulse(2.0, 0.1)),), **MOVING),
        "of 1 of its largest force; .* a delay of three widths", "drive.delay",
    ),
    "a wave in mid-swing": (
        scene(sim.Harmonic(1.0, 10.0, 0.0, 0.1, 0.02), **MOVING), "starts with a jump",
        "drive.delay",
    ),
    "no length": (
        scene(lattice=sim.quads(5, 5, 15.0, 0.0, 0.3)), "has no length", "lattice.ligament_length",
    ),
    "no such unit clamped": (scene(supports=(sim.Clamp(LEFT + 21),)), "no unit 26; .* 0 to 24",
                             "supports"),
    "none below 0": (scene(supports=(sim.Clamp(LEFT - 1),)), "no unit -1", "supports"),
    "driven": (scene(cases=(sim.PrescribedMotion(np.array([25]), sim.LinearRamp(-1.0, 1.0)),)),
               "no unit 25", "drive.units"),
    "of interest": (scene(region=np.array([25])), "no unit 25", "objective.region"),
    "driven twice": (
        scene(cases=(sim.PrescribedMotion(np.array([4, 9, 4]), sim.LinearRamp(-1.0, 1.0)),)),
        "unit 4 is listed twice", "drive.units",
    ),
    "of interest twice": (scene(region=np.array([7, 7])), "unit 7 is listed", "objective.region"),
    "redesigned": (scene(cloak=np.array([25])), "no unit 25", "cloak"),
    "kept": (scene(frozen=np.array([25])), "no unit 25", "cloak"),
    "a list": (scene(region=[12]), "no array of integers", "objective.region"),
    "a float": (scene(region=np.array([12.0])), "no array of integers", "objective.region"),
    "clamped": (
        scene(supports=(sim.Clamp(LEFT), sim.Clamp(LEFT + 4, ("ux",)))),
        "unit 4 is driven by load case 0 and clamped, along ux; drive or clamp", "drive.units",
    ),
    "clamped and loaded": (
        scene(cases=(sim.PrescribedMotion(LEFT, sim.LinearRamp(-1.0, 1.0), FORCES),)),
        "unit 0 is driven by .* along ux", "drive.units",
    ),
    "no margin": (scene(snap_margin=0.0), "margin of 0 bounds nothing", "objective.snap_margin"),
    "below 0": (scene(snap_margin=-0.1), "margin of -0.1", "objective.snap_margin"),
    "no mean": (scene(weights=np.array([3.0])), r"weights \[3.0\] of 1 load", "drive.weights"),
    "too many": (scene(weights=np.array([0.5, 0.5])), "of 1 load cases; give", "drive.weights"),
    "less than none": (scene(sharpness=-1.0), "sharpness of -1 makes", "objective.robust"),
    "no time": (scene(duration=0.0), "duration of 0 s", "horizon.duration"),
    "touches beyond a touch": (
        scene(contact=sim.VoidAngleContact(0.3, 0.1)), "begins at 0.1 rad, beyond its barrier",
        "contact.cutoff_angle",
    ),
    "no such dof": (scene(supports=(sim.Clamp(LEFT, UNKNOWN),)), "no 'uz'; .*ux, uy", "supports"),
}  # fmt: skip


@pytest.mark.parametrize(("posed", "what", "key"), REFUSED.values(), ids=REFUSED)
def test_what_has_no_meaning_is_refused(posed: sim.Scene, what: str, key: str) -> None:
    for door in (check_scene, sim.simulate, sim.evaluate):
        with pytest.raises(SceneError, match=what) as refusal:
            door(posed)
        assert refusal.value.key == key


def test_a_load_case_that_is_not_there_is_refused() -> None:
    for number in (1, -1):
        with pytest.raises(SceneError, match=f"no load case {number}; the scene has 0 to 0"):
            sim.simulate(scene(), cases=[number])


def test_sound_scenes_pass() -> None:
    sound = (
        scene(),
        scene(supports=(sim.Clamp(LEFT, ("ux",)),)),
        scene(series(start=1.0)),  # a path begins where its first load is
        scene(series(), **MOVING),
        scene(  # along a rail
            sim.LinearRamp(1.0, 1.0, np.pi),
            supports=(sim.Clamp(LEFT), sim.Clamp(LEFT + 4, ("uy", "theta"))),
        ),
        scene(
            supports=(sim.Clamp(LEFT), sim.Clamp(LEFT + 4, ("uy",))),
            cases=(sim.PrescribedMotion(LEFT + 4, PULLED, np.array([[0, FREE, 0]] * 5)),),
        ),
        scene(sim.Harmonic(3.0, 10.0), supports=(), **MOVING),
        scene(cases=(pushed(sim.Pulse(2.0, 0.1, np.pi, 0.4)),), **MOVING),
        scene(  # each case holds what the other one moves
            cases=tuple(
                sim.PrescribedMotion(units, sim.LinearRamp(size, 1.0))
                for units, size in ((LEFT, 1.0), (LEFT + 4, -1.0))
            ),
            weights=None,
            supports=(),
        ),
    )
    assert [check_scene(each) for each in sound] == [()] * len(sound)


def test_the_end_of_a_strip_may_be_folded_back() -> None:
    """Beyond the other end, if it is turned: but not by more than twice the strip's length."""
    for far, turned, sound in ((1.3, 3.0, True), (1.3, 0.1, False), (2.1, 3.0, False)):
        end = sim.TimeSeries(
            np.array([0.0, 1.0]), np.array([[0.0] * 3, [-75.0 * far, 0.0, turned]])
        )
        if sound:
            check_scene(scene(end))
        else:
            with pytest.raises(SceneError, match="the lattice is long"):
                check_scene(scene(end))


def test_units_that_cross_themselves_are_refused() -> None:
    for vertices in (crossed(7), rotating_squares().vertices * [-1.0, 1.0]):
        with pytest.raises(SceneError, match=r"unit \d+ at .* edges that cross or corners"):
            sim.simulate(scene(), vertices=vertices)
    far = np.full(scene().space.n_variables, 20.0) * (-1.0) ** np.arange(scene().space.n_variables)
    with pytest.raises(SceneError, match="edges that cross"):
        sim.simulate(scene(), far)
    rig = squeezed(1.0)
    values = rig.values._replace(mass=-rig.values.mass)
    with pytest.raises(sim.SimulationError, match="less than none"):
        solve_case(StaticSolver(rig.topology, np.ones(1)), values, rig.drive)


def test_vertices_that_change_ligaments_are_refused() -> None:
    """With a plan as well; the lattice may have them."""
    lattice = rotating_squares()
    ends = lattice.ligaments[0]
    shifted, turned = lattice.vertices.copy(), lattice.vertices.copy()
    shifted[ends] += 0.5
    turned[ends[0]] += 0.5
    sim.simulate(scene(), vertices=shifted)
    for plan in (None, sim.make_plan(scene())):
        with pytest.raises(SceneError, match=r"units 0 and 1 by 0\.707 mm .* replace\(latt"):
            sim.simulate(scene(), vertices=turned, plan=plan)
    crooked = scene(lattice=replace(lattice, vertices=turned))
    assert check_scene(crooked) == ()


def test_a_small_jump_and_a_loose_unit_are_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    noisy = scene(series(start=0.03), **MOVING)
    assert "starts with a jump, of 0.015" in check_scene(noisy)[0]
    lattice = rotating_squares()
    ends = np.sort(lattice.ligament_units, axis=1).tolist()
    cut = [ends.index(pair) for pair in ([6, 7], [7, 8], [7, 12])]
    loose = scene(lattice=replace(lattice, ligaments=np.delete(lattice.ligaments, cut, axis=0)))
    plan = sim.make_plan(loose)
    assert plan.warnings == tuple(plan.record()["warnings"])
    assert plan.warnings[0].startswith("units that hang on one ligament: 1, the first at [2, 1]")
    assert caplog.messages.count(plan.warnings[0]) == 1


def test_large_structures_say_what_they_need(monkeypatch: pytest.MonkeyPatch) -> None:
    """500 x 500 units, at any number of loads: estimated by the trend of smaller ones."""
    large = scene(lattice=sim.quads(500, 500, 15.0, 2.25, 0.3), supports=(sim.Clamp(LEFT * 500),))
    (told,) = check_scene(large, times=np.linspace(0.01, 1.0, 100))
    assert told.startswith("250000 units: 749970 unknowns, about ")
    assert "GB, and about" in told
    assert "min a path" in told
    monkeypatch.setattr("os.sysconf", lambda name: 1 << (12 if name == "SC_PAGE_SIZE" else 16))
    with pytest.raises(SceneError, match=r"this machine has .*; take fewer units"):
        check_scene(large)


def row(motion: MotionLaw, driven: Ints) -> Rig:
    """Three squares in a row, the first clamped."""
    square = np.array([[4.0, 0.0], [0.0, 4.0], [-4.0, 0.0], [0.0, -4.0]])
    places = [square + np.array([10.0 * k, 0.0]) for k in range(3)]
    return Rig(hand_made(places, np.array([[0, 6], [4, 10]])), np.array([0]), driven, motion)


def test_a_ligament_that_vanishes_on_the_way_is_an_error() -> None:
    """Its ends meet at the second of four loads."""
    rig = row(sim.LinearRamp(-4.0, 1.0), np.array([1]))
    solver = StaticSolver(rig.topology, np.linspace(0.25, 1.0, 4))
    with pytest.raises(sim.SimulationError, match="units 0 and 1 has no length left in state 1"):
        solve_case(solver, rig.values, rig.drive)


@pytest.mark.parametrize("softer", [1e-3, 1e-9])
def test_soft_structures_are_solved_as_well_as_stiff_ones(softer: float) -> None:
    """A floor in N would call any state of a soft one balanced."""
    rig = squeezed(3.0)
    soft = rig.values._replace(law=softer * rig.values.law, contact=softer * rig.values.contact)
    stiff, found = (
        solve_case(StaticSolver(rig.topology, np.array([0.5, 1.0])), values, rig.drive)[0]
        for values in (rig.values, soft)
    )
    np.testing.assert_allclose(found, stiff, atol=1e-9)
