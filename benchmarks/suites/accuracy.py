"""Measures the errors of motions under all kinds of drives: true beside stated, and their time."""

import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from benchmarks.harness import Measurement, MeasuringLimits, Tell
from benchmarks.scenes import paper_scenes
from sim.core import Floats, SimulationError
from sim.scene import (
    Clamp,
    Design,
    Loads,
    Objective,
    Response,
    Scene,
    Structure,
    concrete_parameters,
    estimated_errors,
    sample_times,
    scales,
    simulate,
)
from sim.solvers import Harmonic, MotionLaw, PrescribedMotion, Pulse, TimeSeries, solve_case
from sim.structure import quads
from sim.time_integration import ExplicitSolver
from sim.vibration import lowest_frequency

REFERENCE = "our explicit method of order 4 with 40 000 steps, of 8 microseconds or less"
SETTINGS = tuple(product(("auto", "implicit", "explicit"), ("draft", "default", "tight")))
AMPLITUDE, ANGLE = 3.0, np.pi / 4
"""mm, rad; of the small lattice's drives. The lightly damped one near f1 is chaotic at 3 mm, and at
2 mm it is not."""
PERIODS, SEED, N_PULSES = 6, 1, 6
FINE, MANY = 8e-6, 40_000


def drives() -> Iterator[tuple[str, Scene]]:
    """Yields names and scenes: Figure 2's lattice, and 9 x 9 units shaken at fractions of f1."""
    fig2 = paper_scenes.one_case(paper_scenes.fig2(), 45.0)
    for frequency in (2.0, 8.0, 16.0):
        motion = fig2.loads.motions[0]
        assert isinstance(motion, Harmonic)
        at = motion._replace(frequency=frequency)
        yield f"Figure 2, {frequency:g} Hz", fig2.driven_by(at, frequency=frequency)
    at_rest = small(Harmonic(AMPLITUDE, 1.0), 1.0)
    values = concrete_parameters(at_rest, at_rest.lattice.vertices)
    lowest = lowest_frequency(at_rest.topology, values) / (2 * np.pi)
    for damping, ratios in ((1.0, (0.2, 0.33, 0.5, 0.74)), (0.05, (0.33, 0.74))):
        for ratio in ratios:
            motion = Harmonic(AMPLITUDE, ratio * lowest, ANGLE)
            name = f"9 x 9, {ratio:g} f1" + ("" if damping == 1.0 else ", damping / 20")
            yield name, small(motion, PERIODS / (ratio * lowest), damping)
    yield "pulse of 3 ms", small(Pulse(AMPLITUDE, 3e-3, ANGLE, 0.1), 1.0)
    random = np.random.default_rng(SEED)
    for width, delay in random.uniform((1e-3, 0.05), (3e-3, 0.8), (N_PULSES, 2)):
        motion = Pulse(AMPLITUDE, float(width), ANGLE, float(delay))
        yield f"pulse of {1e3 * width:.3g} ms at {delay:.3g} s", small(motion, 1.0)
    spike = np.zeros((1001, 3))
    spike[401, 0] = AMPLITUDE / 4
    yield "series with a spike of 2 ms", small(TimeSeries(np.linspace(0.0, 1.0, 1001), spike), 1.0)


def small(motion: MotionLaw, duration: float, damping: float = 1.0) -> Scene:
    """Poses 9 x 9 units of Figure 2, clamped at the corners and driven at the centre."""
    material, lattice = paper_scenes.fig2().structure.material, quads(9, 9, 15.0, 2.25, np.pi / 9)
    distance = np.abs(lattice.index - 4).max(axis=1)
    damped = material._replace(
        damping_translation=damping * material.damping_translation,
        damping_rotation=damping * material.damping_rotation,
    )
    return Scene(
        Structure(lattice, damped),
        Loads(
            (PrescribedMotion(np.array([40]), motion),),
            (Clamp(np.array([0, 8, 72, 80])),),
            duration=duration,
        ),
        Objective(region=np.flatnonzero(distance > 2)),
        Design(cloak=np.flatnonzero((distance == 1) | (distance == 2))),
    )


def measure(limits: MeasuringLimits, tell: Tell) -> list[Measurement]:
    """Measures every drive under every setting; processor time of plan and solution."""
    del limits
    measured = []
    for name, scene in drives():
        exact = truth(scene)
        for setting in SETTINGS:
            measured.append(one(name, scene, setting, exact))
            tell(f"{measured[-1].name}: {dict(measured[-1].errors) or measured[-1].failure}")
    return measured


def truth(scene: Scene) -> Floats:
    """Solves for the motion (1, n_times, n_units, 3) with far finer steps."""
    values, times = concrete_parameters(scene, scene.lattice.vertices), sample_times(scene)
    n_steps = max(MANY, int(np.ceil(times[-1] / FINE)))
    solver = ExplicitSolver(scene.topology, float(times[-1]), n_steps, times)
    return solve_case(solver, values, scene.loads.cases[0])[0].reshape(1, len(times), -1, 3)


def one(name: str, scene: Scene, setting: tuple[str, str], exact: Floats) -> Measurement:
    """Measures one drive under one setting: errors of loss and motion, true and stated."""
    integrator, accuracy = setting
    asked = scene.updated(integrator=integrator, accuracy=accuracy)
    shown = Measurement(name, f"{integrator} {accuracy}", "loss", units=scene.lattice.n_units)
    try:
        start = time.process_time()
        response = simulate(asked, vertices=scene.lattice.vertices)
        seconds = time.process_time() - start
        finer = response.refined()
    except SimulationError as failure:
        return replace(shown, failure=str(failure))
    motion, loss = true_errors(response, exact)
    stated_motion, stated_loss = estimated_errors(
        (_region(response, response.displacement), _region(finer, finer.displacement)),
        (float(response.loss), float(finer.loss)),
        float(finer.loss),
    )
    errors = {"loss": loss, "stated loss": stated_loss}
    errors |= {"motion": motion, "stated motion": stated_motion}
    work = paper_scenes.work_of(response.records[0])
    return replace(shown, cpu_s=(seconds,), errors=errors, work=work)


def true_errors(response: Response, exact: Floats) -> tuple[float, float]:
    """Computes the relative errors of motion and loss against a motion that counts as exact."""
    other = Response(response.scene, response.plan, response.parameters, (0,), exact, exact)
    motions = (_region(response, each) for each in (response.displacement, exact))
    moved, wanted = motions
    loss, right = float(response.loss), float(other.loss)
    motion = float(np.linalg.norm(moved - wanted) / np.linalg.norm(wanted))
    return motion, abs(loss - right) / right


def _region(response: Response, motion: Floats) -> Floats:
    scene = response.scene
    return np.asarray(motion[:, :, scene.objective.region]) / scales(scene.lattice.spacing)
