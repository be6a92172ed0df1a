"""Poses the scenes that methods are compared on, each with one load case, at the initial design."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from benchmarks.scenes import paper_scenes
from pipeline.posing import contact_laws, limits_of, scene_of
from pipeline.problem.reading import load
from pipeline.runtime import ROOT
from sim.constraints import Limits
from sim.core import Floats, Ints
from sim.scene import (
    Clamp,
    Mimicking,
    Scene,
    concrete_parameters,
    mimicking,
    parameters_of_design,
    sample_times,
    target_motion,
)
from sim.solvers import Harmonic, LinearRamp, PrescribedMotion
from sim.structure import ConcreteParameters, Parameters, quads

DIRECTION_SEED = 0
CLOAK, REGION = np.array([7, 11, 13, 17]), np.array([6, 8, 16, 18])
"""Of the small lattices: the units beside the middle one, and those at its corners."""
STUDIES = {"fig2": "fig2", "fig4": "fig4", "fig5": "fig5", "fig6": "fig6_heart", "fig7": "fig7"}
TITLES = {
    "fig2": "Figure 2: 15 × 15 units shaken at 45° and 2 Hz for 1 s",
    "fig4": "Figure 4: 15 × 15 units pushed by 15 mm in 10 load steps",
    "fig5": "Figure 5: 15 × 15 units with a void, pushed by 15 mm in 20 load steps",
    "fig6": "Figure 6: 30 × 30 units with a heart-shaped void, pushed by 30 mm in 20 load steps",
    "fig7": "Figure 7: 24 × 24 units with a void, shaken at 30 Hz for 0.3 s",
    "small_wave": "5 × 5 units shaken at 20 Hz for 0.05 s",
    "small_push": "5 × 5 units pushed by 4 mm in 4 load steps",
}


@dataclass(frozen=True)
class LoadCase:
    """Holds a scene with its objective."""

    scene: Scene  # with one load case
    target: Floats | None  # (1, n_times, n_region, 3) motion to mimic, if there is one

    @cached_property
    def times(self) -> Floats:
        """Returns the times (n_times,) of the samples or load steps, s."""
        return sample_times(self.scene)

    @cached_property
    def values(self) -> ConcreteParameters:
        """Returns the parameters of the initial structure."""
        return concrete_parameters(self.scene, self.scene.lattice.vertices)

    @cached_property
    def of_design(self) -> Callable[[Array], Parameters[Array]]:
        """Maps a design (n_variables,) to parameters, differentiable."""
        return parameters_of_design(self.scene)

    def values_of(self, design: Floats) -> ConcreteParameters:
        """Computes the parameters of a design (n_variables,)."""
        return ConcreteParameters(
            *(np.asarray(part) for part in self.of_design(jnp.asarray(design)))
        )

    @cached_property
    def objective(self) -> Mimicking:
        """Returns the loss (1,) of motions (1, n_times, n_units, 3)."""
        return mimicking(self.scene, self.target)

    @cached_property
    def direction(self) -> Floats:
        """Draws random signs (n_variables,): the direction in which slopes are compared."""
        rng = np.random.default_rng(DIRECTION_SEED)
        return rng.choice([-1.0, 1.0], self.scene.space.n_variables)

    def measure(self, motion: Array, values: Parameters[Array]) -> tuple[Array, Array]:
        """Computes the loss of motions (1, n_times, n_units, 3); returns it and the motions."""
        return self.objective(motion, values)[0], motion

    @cached_property
    def measured(self) -> Callable[..., tuple[Array, Array]]:
        """Compiles ``measure``."""
        return jax.jit(self.measure)

    def compile_measures(self) -> None:
        """Compiles ``measure`` for motions of this case, before anything is timed."""
        motion = np.zeros((1, len(self.times), self.scene.lattice.n_units, 3))
        self.measured(motion, self.values)

    def results(self, loss: object, motion: object, gradient: object = None) -> dict[str, Floats]:
        """Collects what is compared: region's motion by spacings, loss, gradient and its slope."""
        spacing = self.scene.lattice.spacing
        moved = np.asarray(motion)[0][:, self.scene.objective.region]
        found = {
            "displacement": moved / np.array([spacing, spacing, 1.0]),
            "loss": np.asarray(loss),
        }
        if gradient is not None:
            gradient = np.asarray(gradient)
            found |= {"gradient": gradient, "slope": np.asarray(gradient @ self.direction)}
        return found


@cache
def case(name: str) -> LoadCase:
    """Poses the case of that name (a key of TITLES)."""
    posed = scene(name)
    return LoadCase(posed, None if posed.objective.reference is None else target_motion(posed))


def scene(name: str) -> Scene:
    """Poses the scene of that name."""
    if name.startswith("small"):
        return _small_wave() if name == "small_wave" else _small_push()
    problem = load(_file(name))
    law = contact_laws(problem)["angle"]  # the paper's, which all methods have
    whole = scene_of(problem, _file(name).parent).updated(symmetry="none", contact=law)
    return paper_scenes.one_case(whole, 45.0) if name == "fig2" else whole


def symmetric(name: str) -> Scene:
    """Poses a scene in time with load cases that quarter turns take into one another."""
    if name == "fig2":
        return paper_scenes.fig2(symmetry="C4")
    turns = tuple(Harmonic(1.0, 20.0, angle) for angle in (0.0, np.pi / 2))
    return scene(name).driven_by(*turns, symmetry="C4")


def designed(name: str) -> tuple[Scene, Limits]:
    """Poses a scene as it is designed, with all load cases, and the limits of a design."""
    if name.startswith("small"):
        return scene(name), Limits(edge_length=5.0, block_angle=np.deg2rad(30.0), void_angle=0.0)
    problem = load(_file(name))
    return scene_of(problem, _file(name).parent), limits_of(problem)


def _file(name: str) -> Path:
    return ROOT / f"experiments/{STUDIES[name]}/problem.yaml"


def _small_wave() -> Scene:
    drive = PrescribedMotion(np.array([12]), Harmonic(1.0, 20.0, 0.3))
    more = {"duration": 0.05, "frequency": 20.0, "samples": 41}
    return _small(paper_scenes.fig2(), np.array([0, 4, 20, 24]), drive, **more)


def _small_push() -> Scene:
    left, material = 5 * np.arange(5), paper_scenes.fig2().structure.material
    drive = PrescribedMotion(left + 4, LinearRamp(-4.0, 1.0))
    return _small(paper_scenes.fig4(), left, drive, material=material, steps=4)


def _small(
    scene: Scene,
    clamped: Ints,
    drive: PrescribedMotion,
    **changes: Any,  # noqa: ANN401
) -> Scene:
    return scene.updated(
        lattice=quads(5, 5, 15.0, 2.25, np.deg2rad(20.0)),
        supports=(Clamp(clamped),),
        cases=(drive,),
        weights=None,
        cloak=CLOAK,
        frozen=None,
        region=REGION,
        **changes,
    )
