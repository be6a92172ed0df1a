"""Solves by the law in JAX with diffrax and its adjoint: what one would write otherwise.

It is the same law (``sim.energy.ligament``), vectorised over ligaments and assembled by segment
sums; driven and clamped dofs are prescribed by elimination. Statics are done as the authors do
them: as damped dynamics of a scene whose mass is scaled up, slow enough to end near the
equilibrium.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from benchmarks.harness import Run, Sample, Task
from sim.core import Floats
from sim.energy import ContactLaw, LigamentLaw, contact_energy, contact_void_angles, ligament_energy
from sim.scene import Mimicking, Scene, parameters_of_design
from sim.solvers import PrescribedMotion, held_values
from sim.structure import Parameters, VoidAngleContact

Force = Callable[[Parameters, Array], Array]
Loss = Callable[[Array], tuple[Array, dict[str, Array]]]
"""Loss of a design vector, and the solver's counts."""


@dataclass(frozen=True)
class RungeKutta:
    """Sets the baseline."""

    rtol: float | Array = 1e-8  # relative tolerance of a step
    atol: float | Array = 1e-4  # the absolute one (mm, mm/s, rad, rad/s alike)
    max_steps: int = 2**17  # bound; the adjoint keeps about its square root in checkpoints
    solver: str = "Dopri5"  # name of a method of diffrax
    adjoint: str = "RecursiveCheckpointAdjoint"  # of diffrax, for the gradient


def force(scene: Scene) -> Force:
    """Makes (parameters, motion (n_units, 3)) -> energy gradient (n_units, 3), N and N mm."""
    pairs, angle = scene.lattice.ligament_units, scene.structure.contact
    assert isinstance(angle, VoidAngleContact)

    def energy(ends: Array, values: tuple[Array, ...]) -> Array:
        arm, vector, void, law, contact = values
        strain = ligament_energy(ends[0], ends[1], arm[0], arm[1], vector, LigamentLaw(*law))
        angles = contact_void_angles(void, ends[0, 2], ends[1, 2])
        return strain + jnp.sum(
            contact_energy(angles, ContactLaw(contact, angle.barrier_angle, angle.cutoff_angle))
        )

    of_ends = jax.vmap(jax.grad(energy))

    def assembled(values: Parameters, motion: Array) -> Array:
        parts = (values.arm, values.vector, values.void, values.law, values.contact)
        each = of_ends(motion[pairs], parts)
        return jax.ops.segment_sum(each.reshape(-1, 3), pairs.ravel(), scene.lattice.n_units)

    return assembled


def field(
    scene: Scene, drive: PrescribedMotion
) -> tuple[Callable[..., Any], Callable[[Array, Array], Array]]:
    """Makes the free dofs' right-hand side, and the map from a time and free dofs to all motion."""
    top = scene.topology
    gradient, free = force(scene), np.sort(top.free_dofs)

    def motion(time: Array, displacement: Array) -> Array:
        held = held_values(top.held, drive.units, drive.motion(time[None]))[0]
        rest = jnp.zeros(top.n_dofs)
        return rest.at[top.held].set(held).at[free].set(displacement).reshape(-1, 3)

    def rates(time: Array, state: tuple[Array, Array], values: Parameters) -> tuple[Array, Array]:
        displacement, velocity = state
        pull = gradient(values, motion(time, displacement)).ravel()[free]
        resistance = values.damping.ravel()[free] * velocity
        return velocity, -(pull + resistance) / values.mass.ravel()[free]

    return rates, motion


def respond(
    scene: Scene, drive: PrescribedMotion, method: RungeKutta, times: Array
) -> Callable[[Parameters], tuple[Array, dict[str, Array]]]:
    """Maps parameters to the motion (n_times, n_units, 3) and the solver's counts."""
    import diffrax

    rates, motion = field(scene, drive)
    n_free = scene.topology.n_free
    zero = (jnp.zeros(n_free), jnp.zeros(n_free))

    def of_parameters(values: Parameters) -> tuple[Array, dict[str, Array]]:
        solution = diffrax.diffeqsolve(
            diffrax.ODETerm(rates),
            getattr(diffrax, method.solver)(),
            t0=0.0,
            t1=scene.loads.duration,
            dt0=None,
            y0=zero,
            args=values,
            saveat=diffrax.SaveAt(ts=times),
            stepsize_controller=diffrax.PIDController(rtol=method.rtol, atol=method.atol),
            adjoint=getattr(diffrax, method.adjoint)(),
            max_steps=method.max_steps,
        )
        counts = {
            "steps": solution.stats["num_accepted_steps"],
            "rejected": solution.stats["num_rejected_steps"],
        }
        return jax.vmap(motion)(times, solution.ys[0]), counts

    return of_parameters


def loss(scene: Scene, method: RungeKutta, times: Floats, measure: Mimicking) -> Loss:
    """Maps a design vector to the loss of the first load case, differentiable, and counts.

    `times` (n_times,) are those of the saved samples, s; `measure` is the loss (1,) of motions (1,
    n_times, n_units, 3).
    """
    of_design = parameters_of_design(scene)
    of_parameters = respond(scene, scene.loads.cases[0], method, jnp.asarray(times))

    def of_case(design: Array) -> tuple[Array, dict[str, Array]]:
        values = of_design(design)
        motion, counts = of_parameters(values)
        return measure(motion[None], values)[0], counts

    return of_case


def prepare(of_case: Loss, n_variables: int, task: Task, suffix: str = "") -> Run:
    """Compiles the loss, or loss and gradient, at the initial design; names end in the suffix."""
    start = jnp.zeros(n_variables)
    wanted = jax.value_and_grad(of_case, has_aux=True) if task == "gradient" else of_case
    compiled = jax.jit(wanted).lower(start).compile()

    def run() -> Sample:
        found = compiled(start)
        (loss, counts), gradient = found if task == "gradient" else (found, None)
        values = {f"loss{suffix}": np.asarray(loss)}
        if gradient is not None:
            values[f"gradient{suffix}"] = np.asarray(gradient)
        return Sample(values, {name: int(count) for name, count in counts.items()})

    return run
