import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_bvp
from shapely import Polygon

from pipeline.fabrication.checks.package_check import page_words
from pipeline.fabrication.papers import read_bill
from pipeline.fabrication.parts import Slot, UnbuildableUnitError, labels
from pipeline.fabrication.units import build_specimen, end_angles, network, strip_between
from pipeline.fabrication.units.prebend import peak_curvature, prebend
from pipeline.fabrication.units.slot_candidates import Corner
from pipeline.fabrication.units.slots import place_slots
from pipeline.fabrication.units.unit_bodies import UnitBody, unit_bodies
from pipeline.fabrication.units.unit_network import UnitNetwork
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Fabrication
from sim.constraints import ConstraintVector, Limits
from sim.core import Floats
from sim.structure import Lattice, angle_between, design_space, quads
from tests.pipeline.fabrication import built, handmade
from tests.tables import some

DESIGN = Path("design.nc")
LATTICE = quads(4, 4, 15.0, 2.25, np.deg2rad(20.0))
ROOM = Fabrication().slot_room
LIMITS = Limits(edge_length=3.0, convex=True, void_angle=0.0, gap=0.2, slots=ROOM)


def way(degrees: float) -> Floats:
    return np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])


def elastica(start: float, end: float, chord: float) -> tuple[float, float]:
    """Length and largest curvature of a strip that slides in clamps at both ends of a chord.

    Its angle t under end forces (p, q) obeys t'' = -p sin t - q cos t; its energy is least over
    its length too where t'^2 / 2 - p cos t + q sin t vanishes.
    """

    def slopes(_: Floats, y: Floats, p: Floats) -> Floats:
        angle, bend, _, _ = y
        force, shear, length = p
        rates = [bend, -force * np.sin(angle) - shear * np.cos(angle), np.cos(angle), np.sin(angle)]
        return length * np.stack(rates)

    def ends(a: Floats, b: Floats, p: Floats) -> Floats:
        energy = a[1] ** 2 / 2 - p[0] * np.cos(a[0]) + p[1] * np.sin(a[0])
        return np.array([a[0] - start, b[0] - end, a[2], b[2] - chord, a[3], b[3], energy])

    s = np.linspace(0.0, 1.0, 60)
    slope = start + (end - start) * s
    guess = np.stack([slope, np.gradient(slope, s) / chord, chord * s, 0.0 * s])
    found = solve_bvp(slopes, ends, s, guess, p=np.array([0.0, 0.0, chord]), tol=1e-8)
    assert found.success
    return float(found.p[2]), float(np.abs(found.sol(np.linspace(0.0, 1.0, 1001))[1]).max())


@pytest.mark.parametrize(("a", "b"), [(-20.0, 20.0), (15.0, 15.0), (30.0, 0.0), (-25.0, 10.0)])
def test_the_curvature_is_near_that_of_the_elastica(a: float, b: float) -> None:
    found = peak_curvature(np.zeros(2), way(a), np.array([2.5, 0.0]), way(b))
    _, exact = elastica(np.radians(a), np.radians(b), 2.5)
    assert float(found) == pytest.approx(exact, rel=0.1)


@pytest.mark.parametrize(
    ("a", "b"),
    [(-20.0, 20.0), (15.0, 15.0), (30.0, 0.0), (-74.2, 65.0), (77.9, -32.1), (43.4, -99.8)],
)
def test_a_strip_between_clamps_is_the_elastica_that_slides_in_them(a: float, b: float) -> None:
    """The last three are shims of Figure 2's cloak."""
    found = strip_between(np.zeros(2), way(a), np.array([2.5, 0.0]), way(b))
    assert found == pytest.approx(elastica(np.radians(a), np.radians(b), 2.5), rel=1e-4)


def test_a_straight_strip_is_as_long_as_its_clamps_are_apart() -> None:
    assert strip_between(np.zeros(2), way(30.0), 2.5 * way(30.0), way(30.0)) == pytest.approx(
        (2.5, 0.0)
    )
    assert np.isinf(strip_between(np.zeros(2), way(140.0), way(0.0), way(140.0)).length)


def test_shims_are_as_long_as_they_lie_in_their_slots() -> None:
    """Not as the line over the slots' mouths, where a shim that is bent has its curve."""
    one = Slot(0, 0, np.zeros(2), -way(-70.0), 3.0, 0.45, 0.5, 1.0)
    other = replace(one, mouth=np.array([2.25, 0.0]), direction=way(60.0), truncation=0.2)
    found = prebend(one, other, Fabrication())
    chord = other.held - one.held
    start, end = (float(angle_between(chord, each)) for each in (way(-70.0), way(60.0)))
    length, _ = elastica(start, end, float(np.linalg.norm(chord)))
    assert found.free == pytest.approx(length, rel=1e-4)


def test_a_shim_of_the_paper_towards_the_centroids_is_bent_to_an_arc() -> None:
    settings = Fabrication()
    one = Slot(0, 0, np.zeros(2), -way(-20.0), 3.0, 0.45, 0.0, 1.0)
    other = replace(one, mouth=np.array([2.25, 0.0]), direction=way(20.0))
    found = prebend(one, other, settings)
    assert np.degrees(found.angles) == pytest.approx([-20.0, 20.0])
    length, curvature = elastica(-np.radians(20.0), np.radians(20.0), 2.25)
    assert curvature == pytest.approx(2 * np.radians(20.0) / 2.25, rel=0.02)  # nearly an arc's
    assert found.free == pytest.approx(length)
    assert found.strain == pytest.approx(0.125 * curvature)  # 3.8 %
    assert found.moment == pytest.approx(4500 * 8.1 * 0.25**3 / 12 * curvature)
    assert prebend(other, one, settings).strain == pytest.approx(found.strain)


def test_slots_that_turn_bend_their_shims_others_leave_them_straight() -> None:
    net = network(built.design(), "cloaked")
    specimen = build_specimen(net, Fabrication(), ("toy", ""), DESIGN)
    assert np.max([ligament.strain for ligament in specimen.ligaments]) < 1e-9
    for made, drawn in zip(specimen.ligaments, handmade.specimen().ligaments, strict=True):
        assert made.middle == pytest.approx(drawn.middle)
    assert specimen.bent == []
    # the corner of unit B1 that faces A1 is so sharp that its slot cannot follow the ligament
    design = sharpened()
    specimen = build_specimen(network(design, "cloaked"), Fabrication(), ("toy", ""), DESIGN)
    (bent,) = (one for one in specimen.ligaments if one.name == "A1 - B1")
    assert abs(bent.angles[1]) > np.radians(10.0)
    assert bent.angles[0] * bent.angles[1] < 0  # an arc, not an S, as far as the walls of A1 allow
    assert bent in specimen.bent


def sharpened() -> xr.Dataset:
    """The six squares, the middle one of the lower row drawn out along a line off its ligaments."""
    design = built.design()
    corners = design["vertices"].values.copy()
    corners[1, 1] += [-2.0, -5.0]
    corners[1, 3] += [-2.0, 4.0]
    design["vertices"] = design["vertices"].copy(data=corners)
    return design


def test_shims_that_are_bent_too_much_are_refused() -> None:
    asked = {"slots": {"direction": "centroid"}, "shims": {"prebend_strain": 0.02}}
    settings = Fabrication.model_validate(asked, context=SIM_UNITS)
    with pytest.raises(UnbuildableUnitError) as caught:
        build_specimen(network(built.design(), "cloaked"), settings, ("toy", ""), DESIGN)
    assert caught.value.key == "fabrication.shims.prebend_strain"
    assert "is bent to a strain of 3.0 % before any load" in str(caught.value)


def test_papers_tell_how_every_shim_is_bent(tmp_path: Path) -> None:
    built.write(tmp_path / "cloaked", {"slots": {"direction": "centroid"}})
    told = json.loads((tmp_path / "cloaked/manifest.json").read_text())["prebend"]
    assert len(told) == len(handmade.neighbours())
    assert np.abs(told["0"]["end_angles_deg"]) == pytest.approx([20.0, 20.0])
    assert told["0"]["strain"] == pytest.approx(0.0302, abs=1e-4)
    rows = [row for row in read_bill(tmp_path / "cloaked/bom.csv") if row["item"] == "ligament"]
    assert len(rows) == len(told)
    assert "strain 3.02 %, moment" in rows[0]["note"]
    last = page_words(tmp_path / "cloaked/assembly.pdf")[-1]
    assert "7 of 7 shims are bent before any load" in last[0]
    assert "worst 7" in last


def network_of(lattice: Lattice, vertices: Floats) -> UnitNetwork:
    """All units and ligaments of a lattice with its vertices there."""
    rings = np.split(vertices, lattice.first_vertex[1:-1])
    own = np.arange(lattice.n_vertices) - lattice.first_vertex[lattice.unit]
    joints = []
    for number, (a, b) in enumerate(lattice.ligaments):
        ends = [(int(lattice.unit[k]), int(own[k])) for k in (a, b)]
        along = (vertices[b] - vertices[a]) / np.linalg.norm(vertices[b] - vertices[a])
        joints.append((number, ends[0], ends[1], along))
    index = [(int(i), int(j)) for i, j in lattice.index]
    polygons = dict(enumerate(map(Polygon, rings)))
    named = dict(enumerate(labels(index))), dict(enumerate(index))
    return UnitNetwork(tuple(polygons), polygons, *named, tuple(joints), (), ())


def designs(
    seed: int, limits: Limits, *, turning: bool = False
) -> tuple[ConstraintVector, Floats, int]:
    """Random designs of 4 x 4 squares, ever larger, and which is the last within the limits."""
    space = design_space(LATTICE, np.array([5, 6, 9, 10]), turning=turning)
    constraints = ConstraintVector(space, limits)
    way = np.random.default_rng(seed).uniform(-1.0, 1.0, space.n_variables)
    drawn = np.linspace(0.0, 6.0, 121)[:, None] * way
    least = np.array([constraints.values(design).min() for design in drawn])
    return constraints, drawn, int(np.argmax(least < 0.0)) - 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_a_design_with_room_for_straight_slots_has_none_that_turns(seed: int) -> None:
    """Random shifts, as large as the limits allow: the rule of slots finds straight ones."""
    settings = Fabrication()
    constraints, drawn, last = designs(seed, LIMITS)
    kept, lost = (constraints.vertices(drawn[last + more]) for more in (0, 30))
    straight, bent = (
        strains(LATTICE, unit_bodies(network_of(LATTICE, each), settings, DESIGN), settings)
        for each in (kept, lost)
    )
    assert straight.max() < 1e-9
    assert bent.max() > 0.01


@pytest.mark.parametrize("seed", some(range(3), 1))
def test_slots_that_turn_with_the_design_are_drawn_so(seed: int) -> None:
    """Random shifts and angles, as large as the limits allow."""
    limits = replace(LIMITS, slot_turn=np.deg2rad(30.0))
    constraints, drawn, last = designs(seed, limits, turning=True)
    space = design_space(LATTICE, np.array([5, 6, 9, 10]), turning=True)
    angles = np.asarray(space.end_angles(drawn[last]))
    net = network_of(LATTICE, constraints.vertices(drawn[last]))
    turned = replace(net, turns={number: (a, b) for number, (a, b) in enumerate(angles.tolist())})
    assert np.degrees(np.abs(angles)).max() > 3.0
    np.testing.assert_allclose(end_angles(turned, Fabrication(), DESIGN), angles, atol=1e-9)


def test_turned_slots_of_a_slender_unit_are_as_deep_as_its_design_has_room_for() -> None:
    """A unit of a cloak, whose slots meet at any depth of the few that are preferred."""
    unit = Polygon([[1.4302, 6.7237], [-0.9664, 8.5282], [-5.4147, -2.6463], [4.9509, -12.6055]])
    ways = {2: (1.0, 0.0), 0: (-1.0, 0.0), 3: (0.0, 1.0), 1: (0.0, -1.0)}
    turns = {2: 0.48616, 0: 0.25573, 3: 0.5236, 1: -0.08797}
    corners = [Corner(at, at, np.array(way), 2.25, turns[at]) for at, way in ways.items()]
    slots = place_slots(unit, corners, Fabrication(), unit)
    for slot in slots:
        x, y = ways[slot.vertex]
        turned = np.arctan2(x * slot.direction[1] - y * slot.direction[0], slot.direction @ (x, y))
        assert turned == pytest.approx(turns[slot.vertex], abs=1e-9)


def strains(lattice: Lattice, made: dict[int, UnitBody], settings: Fabrication) -> Floats:
    """Strains (n_ligaments,) of the shims before any load."""
    ends: dict[int, list[Slot]] = {number: [] for number in range(lattice.n_ligaments)}
    for body in made.values():
        for slot in body.slots:
            ends[slot.ligament].append(slot)
    return np.array([prebend(one, other, settings).strain for one, other in ends.values()])
