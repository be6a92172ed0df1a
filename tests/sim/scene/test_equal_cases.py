import tracemalloc
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import sim
from benchmarks.scenes import MATERIAL
from sim.core import Ints
from sim.scene.equal_cases import equal_cases, quarter_turn
from sim.structure import design_space
from tests.sim.structures import mixed_polygons, rotating_squares

LATTICE = rotating_squares()
CORNERS, MIDDLE = np.array([0, 4, 20, 24]), np.array([12])
LEFT = 5 * np.arange(5)[1:-1]
EDGES = LEFT, np.array([1, 2, 3]), LEFT + 4, np.array([21, 22, 23])
"""Units of the left, lower, right and upper edge."""


def scene(*cases: tuple[Ints, sim.MotionLaw], **changes: Any) -> sim.Scene:  # noqa: ANN401
    """5 x 5 squares, corners clamped, units between the edge and the middle of interest."""
    pairs = cases or tuple((MIDDLE, sim.LinearRamp(2.0, 1.0, a)) for a in (0.3, 0.3 + np.pi / 2))
    made = sim.Scene(
        sim.Structure(LATTICE, MATERIAL),
        sim.Loads(
            tuple(sim.PrescribedMotion(*pair) for pair in pairs), (sim.Clamp(CORNERS),), static=True
        ),
        sim.Objective(region=np.array([6, 8, 16, 18]), steps=2),
    )
    return made.updated(**changes)


def found(posed: sim.Scene) -> list[int]:
    vertices = posed.lattice.vertices
    return list(equal_cases(posed, vertices, sim.concrete_parameters(posed, vertices)))


def right_half(of_unit: bool) -> np.ndarray:
    """The units, or ligaments, on the right."""
    x = LATTICE.site[:, 0] if of_unit else LATTICE.site[LATTICE.ligament_units[:, 0], 0]
    return x > LATTICE.site[:, 0].mean()


def uneven(field: str, of_unit: bool) -> dict[str, Any]:
    """A constant that is twice as large on the right."""
    values = getattr(MATERIAL, field) * (1.0 + right_half(of_unit))
    return {"material": MATERIAL._replace(**{field: values})}


SUPPORTS = {
    "a free corner": {"supports": (sim.Clamp(CORNERS[:-1]),)},
    "half-clamped corners": {"supports": (sim.Clamp(CORNERS, ("ux",)),)},
    "region": {"region": np.array([6, 7])},
}
CONSTANTS = {
    "axial": uneven("axial_stiffness", of_unit=False),
    "shear": uneven("shear_stiffness", of_unit=False),
    "bending": uneven("bending_stiffness", of_unit=False),
    "length of ligaments": {"material": MATERIAL._replace(elongation=0.1 * right_half(False))},
    "bend of ligaments": {
        "material": MATERIAL._replace(
            end_angles=0.1 * right_half(False)[:, None] * np.array([1.0, -1.0])
        )
    },
    "contact": uneven("contact_stiffness", of_unit=False),
    "mass": uneven("density", of_unit=True),
    "damping": uneven("damping_translation", of_unit=True),
    "damping of rotations": uneven("damping_rotation", of_unit=True),
}
NETWORKS = {
    "missing ligaments": {"lattice": replace(LATTICE, ligaments=LATTICE.ligaments[3:])},
    "a missing unit": {"lattice": LATTICE.without(np.array([7])), "region": np.array([6, 15])},
}


def test_a_quarter_turn_makes_cases_equal() -> None:
    assert found(scene()) == [0, 0]
    turned = [
        sim.LinearRamp(2.0, 1.0, np.deg2rad(a)) for a in (0.0, 45.0, 90.0, 135.0, -180.0, 10.0)
    ]
    assert found(scene(*((MIDDLE, motion) for motion in turned))) == [0, 1, 0, 1, 0, 5]


@pytest.mark.parametrize("changes", (CONSTANTS | NETWORKS | SUPPORTS).values(),
                         ids=(CONSTANTS | NETWORKS | SUPPORTS).keys())  # fmt: skip
def test_what_the_turn_does_not_keep_makes_them_differ(changes: dict[str, Any]) -> None:
    assert found(scene(**changes)) == [0, 1]


@pytest.mark.parametrize(
    "changes", [CONSTANTS["shear"], NETWORKS["missing ligaments"]], ids=["stiffness", "ligaments"]
)
def test_each_case_of_an_uneven_structure_has_its_own_loss(changes: dict[str, Any]) -> None:
    posed = scene(**changes)
    vertices = posed.lattice.vertices
    short = sim.simulate(posed, vertices=vertices, plan=sim.make_plan(posed, vertices)).losses
    each = [float(sim.simulate(posed.alone(case), vertices=vertices).loss) for case in (0, 1)]
    assert abs(each[0] - each[1]) > 1e-3 * each[0]
    np.testing.assert_allclose(short, each, rtol=1e-9)


def test_an_even_change_of_constants_keeps_them_equal() -> None:
    distance = np.abs(LATTICE.site - LATTICE.site.mean(axis=0)).max(axis=1)
    assert found(scene(material=MATERIAL._replace(density=MATERIAL.density * distance))) == [0, 0]
    assert found(scene(material=MATERIAL._replace(elongation=np.full(40, 0.1)))) == [0, 0]


def test_a_bend_is_told_from_either_end_of_a_ligament() -> None:
    """All ligaments are bent away from the middle: by the opposite where their ends change."""
    image = quarter_turn(LATTICE, LATTICE.vertices)
    assert image is not None
    bend: np.ndarray = np.zeros(LATTICE.n_ligaments)
    for first in range(LATTICE.n_ligaments):
        at, sign = first, 1
        while bend[at] == 0.0:
            bend[at] = 0.1 * sign
            sign, at = sign * image.reversed[at], image.ligament[at]
    angles = np.stack([bend / 2, -bend / 2], axis=1)
    assert found(scene(material=MATERIAL._replace(end_angles=angles))) == [0, 0]
    assert found(scene(material=MATERIAL._replace(end_angles=np.abs(angles)))) == [0, 0]
    angles = np.full((LATTICE.n_ligaments, 2), [0.05, -0.05])
    assert found(scene(material=MATERIAL._replace(end_angles=angles))) == [0, 1]


def test_driven_units_are_turned_with_their_motion() -> None:
    inwards = [(edge, sim.LinearRamp(1.0, 1.0, k * np.pi / 2)) for k, edge in enumerate(EDGES)]
    assert found(scene(*inwards)) == [0, 0, 0, 0]
    both_to_the_right = [(edge, sim.LinearRamp(1.0, 1.0, 0.0)) for edge in EDGES]
    assert found(scene(*both_to_the_right)) == [0, 1, 2, 3]
    one_alone = [
        (edge, sim.LinearRamp(1.0, 1.0, k * np.pi / 2)) for k, edge in enumerate(EDGES[:2])
    ]
    assert found(scene(*one_alone)) == [0, 1]  # the other edges are held by neither


@pytest.mark.parametrize(
    "other",
    [sim.TanhRamp(2.0, 1.0, 0.0), sim.Pulse(2.0, 1.0, 0.0), sim.LinearRamp(2.5, 1.0, 0.0)],
    ids=["law", "pulse", "amplitude"],
)
def test_motions_of_another_kind_are_no_copies(other: sim.MotionLaw) -> None:
    assert found(scene((MIDDLE, sim.LinearRamp(2.0, 1.0, 0.0)), (MIDDLE, other))) == [0, 1]


def test_squares_have_an_image_and_other_structures_none() -> None:
    image = quarter_turn(LATTICE, LATTICE.vertices)
    assert image is not None
    np.testing.assert_array_equal(image.unit[[0, 4, 24, 20, 12]], [4, 24, 20, 0, 12])
    ends = np.sort(image.unit[LATTICE.ligament_units], axis=1)
    np.testing.assert_array_equal(ends, np.sort(LATTICE.ligament_units[image.ligament], axis=1))
    space = design_space(LATTICE, np.array([6, 7]))
    moved = np.asarray(space.vertices(0.01 * np.ones(space.n_variables)))
    assert quarter_turn(LATTICE, moved) is None
    mixed = mixed_polygons()
    assert quarter_turn(mixed, mixed.vertices) is None


def test_large_lattices_need_little_memory_and_one_case_none() -> None:
    """Distances of all pairs of 3600 units would take 200 MB."""
    large = sim.quads(60, 60, 15.0, 2.25, np.deg2rad(20.0))
    corners = np.array([0, 59, 3540, 3599])
    posed = scene(
        (corners, sim.LinearRamp(1.0, 1.0, 0.0)), (corners, sim.LinearRamp(1.0, 1.0, np.pi / 2)),
        lattice=large, supports=(), region=np.zeros(0, dtype=int),
    )  # fmt: skip
    values = sim.concrete_parameters(posed, large.vertices)
    assert _peak(posed, values) < 20e6
    assert _peak(posed.alone(0), values) < 1e4


def _peak(posed: sim.Scene, values: Any) -> int:  # noqa: ANN401
    tracemalloc.start()
    try:
        equal_cases(posed, posed.lattice.vertices, values)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
