"""Small structures, drives and losses that the tests of the physics share."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import sim
from benchmarks.scenes import BARRIER, CUTOFF, MATERIAL
from sim.core import Floats, Ints
from sim.energy import Topology, topology
from sim.energy.network_arrays import NetworkArrays
from sim.linalg import Matrix, entry
from sim.solvers import DISPLACEMENT, Solver, concrete, differentiable_motion, held_dofs
from sim.structure import (
    ConcreteParameters,
    DesignSpace,
    Parameters,
    design_space,
    parameters,
    parameters_at,
    shape,
)

NONE = np.array([], dtype=np.int64)
RING = np.array([6, 7, 8, 11, 13, 16, 17, 18])
"""The units around the middle of 5 x 5."""
LEFT, CORNERS, MIDDLE = 5 * np.arange(5), np.array([0, 4, 20, 24]), np.array([12])


def pressed(depth: float, **changes: Any) -> sim.Scene:  # noqa: ANN401  (fields of a scene)
    """5 x 5 squares, the left column clamped, the right one pushed in; the middle is to rest."""
    drive = sim.PrescribedMotion(LEFT + 4, sim.LinearRamp(-depth, 1.0))
    made = sim.Scene(
        sim.Structure(rotating_squares(), MATERIAL),
        sim.Loads((drive,), (sim.Clamp(LEFT),), static=True),
        sim.Objective(region=np.array([12]), steps=2),
        sim.Design(cloak=RING),
    )
    return made.updated(**changes)


def taylor_orders(value: Callable[[float], Any], slope: float | Floats, steps: Floats) -> Floats:
    """Powers with which the remainder of a value's linear model falls from step to step: 2."""
    left = np.log([np.abs(value(step) - value(0.0) - step * slope) for step in steps])
    return (np.diff(left, axis=0).T / np.diff(np.log(steps))).T


def central(value: Callable[[float], Any], step: float) -> Any:  # noqa: ANN401  (as the value)
    """Slope of a value at zero by central differences."""
    return (np.asarray(value(step)) - np.asarray(value(-step))) / (2 * step)


def at_rest(lattice: sim.Lattice) -> ConcreteParameters:
    """Parameters of a lattice as it is."""
    return concrete(parameters_at(lattice, lattice.vertices, MATERIAL))


def assert_equal(found: Floats, wanted: Array | Floats) -> None:
    """Asserts equality but for 1e-12 of the largest entry."""
    assert np.abs(found - wanted).max() <= 1e-12 * np.abs(wanted).max()


def some_ligaments(net: NetworkArrays, which: Ints) -> NetworkArrays:
    """A network's ligaments ``which`` alone, without contact."""
    chosen = {name: part[which] for name, part in net._asdict().items() if name != "touching"}
    return NetworkArrays(**chosen, touching=NONE)


def dense(of: Matrix) -> Floats:
    if of.pattern.storage == "panels":
        rows, columns, entries = _entries_of_panels(of)
    elif of.pattern.storage == "band":
        n, width = of.pattern.size
        lower = of.values.reshape(n, width + 1)
        columns, below = np.nonzero(lower)
        rows, entries = columns + below, lower[columns, below]
    else:
        rows, columns, entries = _entries_of_fronts(of)
    full = np.zeros((of.pattern.size[0],) * 2)
    full[rows, columns] = full[columns, rows] = entries
    return full


def _entries_of_panels(of: Matrix) -> tuple[Ints, Ints, Floats]:
    n, first = of.pattern.n_dofs, of.pattern.panels.first
    rows, columns = np.tril_indices(n)
    panel = columns // 4
    within = rows - 4 * panel < np.diff(first)[panel] // 4
    rows, columns = rows[within], columns[within]
    at = [entry(of.pattern, *pair) for pair in zip(rows.tolist(), columns.tolist(), strict=True)]
    return rows, columns, of.values[at]


def _entries_of_fronts(of: Matrix) -> tuple[Ints, Ints, Floats]:
    fronts, found = of.pattern.fronts, []
    for front in range(len(fronts.update)):
        own = np.arange(fronts.first[front], fronts.first[front + 1])
        rows = np.concatenate([own, fronts.boundary[fronts.edge[front] : fronts.edge[front + 1]]])
        panel = of.values[fronts.panel[front] : fronts.panel[front + 1]]
        pairs = np.meshgrid(own, rows, indexing="ij")
        found.append((pairs[1].ravel(), pairs[0].ravel(), panel))
    rows, columns, entries = (np.concatenate(part) for part in zip(*found, strict=True))
    lower = rows >= columns
    return rows[lower], columns[lower], entries[lower]


def rotating_squares(side: int = 5, bias_deg: float = 20.0) -> sim.Lattice:
    return sim.quads(side, side, 15.0, 2.25, np.deg2rad(bias_deg))


def mixed_polygons() -> sim.Lattice:
    """A hexagon with a triangle at each corner, chained to a ring, and a pentagon at one end."""
    ring = np.deg2rad(60.0) * np.arange(6)
    outward = np.stack([np.cos(ring), np.sin(ring)], axis=1)
    across = np.stack([-np.sin(ring), np.cos(ring)], axis=1)
    triangles = [
        np.stack([8 * o, 16 * o - 5 * t, 16 * o + 5 * t])
        for o, t in zip(outward, across, strict=True)
    ]
    fifths = np.pi + np.deg2rad(72.0) * np.arange(5)
    pentagon = [25.0, -5.0] + 5 * np.stack([np.cos(fifths), np.sin(fifths)], axis=1)
    polygons = [6 * outward, *triangles, pentagon]

    corner = np.cumsum([0] + [len(polygon) for polygon in polygons])
    spokes = [(k, corner[1 + k]) for k in range(6)]
    chain = [(corner[1 + k] + 2, corner[2 + k] + 1) for k in range(5)]
    return hand_made(polygons, np.array([*spokes, *chain, (corner[1] + 1, corner[7])]))


def hand_made(polygons: list[Floats], ligaments: Ints) -> sim.Lattice:
    """Lattice of any polygons; ``ligaments`` (n, 2) use each vertex at most once."""
    n_vertices = sum(len(polygon) for polygon in polygons)
    group = np.arange(n_vertices)
    group[ligaments[:, 1]] = group[ligaments[:, 0]]
    n_units = len(polygons)
    return sim.Lattice(
        vertices=np.concatenate(polygons),
        unit=np.repeat(np.arange(n_units), [len(polygon) for polygon in polygons]),
        ligaments=ligaments,
        group=np.unique(group, return_inverse=True)[1],
        site=np.array([polygon.mean(axis=0) for polygon in polygons]),
        index=np.stack([np.arange(n_units), np.zeros(n_units, dtype=int)], axis=1),
        spacing=15.0,
        id=np.arange(n_units),
    )


class Numbers(NamedTuple):
    """Everything that a response may be differentiated by."""

    design: Array | Floats  # (n_variables,) mm
    stiffness: Array | Floats  # (n_ligaments, 3) factors on axial, shear and bending stiffness
    contact: Array | Floats  # (n_ligaments,) factors on the contact stiffness
    density: Array | Floats  # factor
    damping: Array | Floats  # (n_units, 2) factors on translational and rotational damping
    drive: sim.MotionLaw  # itself a tree of numbers


@dataclass(frozen=True, eq=False)
class Rig:
    """A small structure, clamped and driven, all of whose numbers can be varied."""

    lattice: sim.Lattice  # every vertex but those of the driven units is a design variable
    clamped: Ints  # units
    driven: Ints
    motion: sim.MotionLaw  # of the driven units
    distance: float | None = None  # within which units touch, mm; None for contact on void angles
    control: Ints | None = None  # (n_driven, 3) which dofs are displaced, loaded or free

    @cached_property
    def space(self) -> DesignSpace:
        return design_space(self.lattice, np.arange(self.lattice.n_units), self.driven)

    @cached_property
    def topology(self) -> Topology:
        angles = sim.VoidAngleContact(BARRIER, CUTOFF)
        contact = angles if self.distance is None else sim.DistanceContact(self.distance)
        held = held_dofs(self.clamped, self.driven)
        if self.control is not None:
            dofs = 3 * self.driven[:, None] + np.arange(3)
            held = np.setdiff1d(held, dofs[self.control != DISPLACEMENT])
        return topology(self.lattice, held, contact, loaded=self.drive.loaded)

    @property
    def numbers(self) -> Numbers:
        return Numbers(
            design=np.zeros(self.space.n_variables),
            stiffness=np.ones((self.lattice.n_ligaments, 3)),
            contact=np.ones(self.lattice.n_ligaments),
            density=np.ones(()),
            damping=np.ones((self.lattice.n_units, 2)),
            drive=jax.tree.map(lambda x: np.asarray(x, dtype=float), self.motion),
        )

    @cached_property
    def parameters(self) -> Callable[[Numbers], Parameters]:
        """Compiled map from the numbers to what the solvers take."""

        @jax.jit
        def of_numbers(numbers: Numbers) -> Parameters:
            axial, shear, bending = numbers.stiffness.T
            one = numbers.density * MATERIAL.density
            material = sim.Material(
                one,
                MATERIAL.axial_stiffness * axial,
                MATERIAL.shear_stiffness * shear,
                MATERIAL.bending_stiffness * bending,
                MATERIAL.contact_stiffness * numbers.contact,
                MATERIAL.damping_translation * numbers.damping[:, 0],
                MATERIAL.damping_rotation * numbers.damping[:, 1],
            )
            made = shape(self.lattice, self.space.vertices(numbers.design))
            return parameters(self.lattice, made, material)

        return of_numbers

    @property
    def values(self) -> Parameters:
        """Parameters of the initial structure as NumPy arrays."""
        return self.values_of(self.numbers.design)

    def values_of(self, design: Array | Floats) -> Parameters:
        """Parameters of another design (n_variables,), mm."""
        made = self.parameters(self.numbers._replace(design=jnp.asarray(design)))
        return Parameters(*map(np.asarray, made))

    @property
    def drive(self) -> sim.PrescribedMotion:
        return self.driven_by(self.motion)

    def driven_by(self, motion: sim.MotionLaw) -> sim.PrescribedMotion:
        return sim.PrescribedMotion(self.driven, motion, self.control)

    def loss(self, solver: Solver, numbers: Numbers) -> Array:
        """A smooth function of displacement and velocity without any symmetry."""
        drive = self.driven_by(numbers.drive)
        response = differentiable_motion(solver, self.parameters(numbers), (drive,))
        return uneven_loss(response.displacement, response.velocity)


@cache
def squeezed(
    depth: float, side: int = 5, bias_deg: float = 20.0, distance: float | None = None
) -> Rig:
    """Squares between plates, of which one moves in."""
    left, drive = side * np.arange(side), sim.LinearRamp(-depth, 1.0)
    return Rig(rotating_squares(side, bias_deg), left, left + side - 1, drive, distance)


@cache
def shaken(amplitude: float = 2.0, bias_deg: float = 20.0, distance: float | None = None) -> Rig:
    """5 x 5 squares, the corners clamped, the middle shaken at 150 Hz from some 3 ms on."""
    motion = sim.Harmonic(amplitude, 150.0, 0.6, rise=0.0015, delay=0.003)
    return Rig(rotating_squares(5, bias_deg), CORNERS, MIDDLE, motion, distance)


def uneven_loss(displacement: Array | Floats, velocity: Array | Floats) -> Array:
    """Sum of weighted squares of motions (n_cases, n_times, n_units, 3) and their velocities."""
    return _uneven(displacement, 1.0) + _uneven(velocity, 1e-3)


@jax.jit
def _uneven(motion: Array | Floats, scale: float) -> Array:
    """Sum of squares of (n_cases, n_times, n_units, 3) with weights that differ everywhere."""
    weights = 1.5 + jnp.sin(jnp.arange(motion.size, dtype=float)).reshape(motion.shape)
    lengths = scale * motion * jnp.array([1.0, 1.0, 7.5])
    return jnp.sum(weights * lengths**2) / motion.shape[1]
