"""The force of a drive against the balance of momentum."""

from dataclasses import replace

import numpy as np

import sim
from sim.energy import observe
from sim.scene import drive_force
from sim.solvers import Superposition
from tests.sim.scene.test_plan import scene as seven_by_seven
from tests.sim.structures import LEFT, pressed

FREQUENCY = 100.0
TIMES = np.linspace(0.0, 0.1, 2001)


def shaken() -> sim.Scene:
    motion = sim.Harmonic(1.0, FREQUENCY, 0.4, rise=0.01, delay=0.06)
    drive = sim.PrescribedMotion(np.arange(14, 35), motion)
    return seven_by_seven(cases=(drive,), weights=np.ones(1), accuracy="tight")


def test_forces_of_drive_and_supports_change_the_momentum() -> None:
    scene = shaken()
    response = sim.simulate(scene, times=TIMES)
    values, seen = response.parameters, response.observables[0]
    velocity = response.velocity[0][..., :2]
    rate = np.gradient(np.einsum("un,tun->tn", values.mass[:, :2], velocity), TIMES, axis=0)
    damped = np.einsum("un,tun->tn", values.damping[:, :2], velocity)
    supports = seen.force_on(scene.loads.supports[0].units)
    wanted = (rate + damped - supports)[5:-5]
    found = response.drive_force[0][5:-5]
    np.testing.assert_allclose(found, wanted, atol=2e-3 * np.abs(wanted).max())
    elastic = seen.force_on(scene.loads.driven)[5:-5]
    assert np.abs(elastic - wanted).max() > 0.5 * np.abs(wanted).max()


def test_units_that_are_not_meant_add_nothing() -> None:
    """Each driven unit has a force of its own; equilibria have no inertia."""
    scene = shaken()
    response = sim.simulate(scene, times=TIMES[::100])
    told = scene, response.parameters, response.observables[0], scene.loads.cases[0]
    one, other = (
        drive_force(*told, response.times, units) for units in (np.array([14]), np.arange(15, 35))
    )
    np.testing.assert_allclose(one + other, response.drive_force[0], atol=1e-12)
    still = replace(scene, loads=replace(scene.loads, static=True))
    elastic = observe(scene.topology, response.parameters, response.displacement[0])
    np.testing.assert_array_equal(
        drive_force(still, *told[1:], response.times),
        elastic.force_on(scene.loads.driven),
    )


def test_each_case_has_the_force_of_its_own_units() -> None:
    """Of two sides pressed at once it is that of the first, the other's being opposite."""
    right = LEFT + 4
    ways = sim.LinearRamp(1.0, 1.0), sim.LinearRamp(-1.0, 1.0)
    both = Superposition(ways, np.repeat(np.eye(2), 5, axis=0))
    alone = (sim.PrescribedMotion(*side) for side in zip((LEFT, right), ways, strict=True))
    for cases, units in (
        (tuple(alone), (LEFT, right)),
        ((sim.PrescribedMotion(np.concatenate([LEFT, right]), both),), (LEFT,)),
    ):
        response = sim.simulate(pressed(1.0, cases=cases, supports=()))
        for case, own in enumerate(units):
            force = response.observables[case].force_on(own)
            assert abs(force[-1, 0]) > 0.1
            np.testing.assert_array_equal(response.drive_force[case], force)
