"""Bars hold all units of an edge, and do not stand in one another's way."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import combinations, pairwise

import numpy as np
import pytest
import shapely
from shapely import LineString, Polygon, affinity

from pipeline import datasets, problem
from pipeline.fabrication.engraving import place_id
from pipeline.fabrication.fixtures import fixtures
from pipeline.fabrication.fixtures.holder_bases import held_edges, plan_bases
from pipeline.fabrication.parts import BuiltSpecimen
from pipeline.fabrication.units import build_specimen, network, specimen_units
from pipeline.problem import Problem
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Fabrication
from pipeline.runtime import ROOT
from sim.core import Floats
from tests.pipeline import unchanged
from tests.pipeline.fabrication import handmade

Change = tuple[str, str]
Draft = Callable[..., tuple[Problem, BuiltSpecimen]]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Draft:
    """Makes the draft of a study, undesigned, once, its ids placed anywhere: no holder asks."""

    @cache
    def made(name: str, *changes: Change) -> tuple[Problem, BuiltSpecimen]:
        path = tmp_path_factory.mktemp(name) / "problem.yaml"
        text = (ROOT / f"experiments/{name}/problem.yaml").read_text(encoding="utf-8")
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path.write_text(text, encoding="utf-8")
        asked = problem.load(path, "quick")
        design = unchanged.write(path, "quick")
        net = network(datasets.read(design, "design"), "altered")
        rim = net.polygons[0]
        somewhere = place_id("A1", rim, rim, asked.fabrication.labels)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(specimen_units, "place_id", lambda *_: somewhere)
            return asked, build_specimen(net, asked.fabrication, (name, "altered"), design)

    return made


@pytest.fixture
def lattice(built: Draft) -> tuple[Problem, BuiltSpecimen]:
    """7 x 7 squares."""
    return built("fig2")


def test_both_triangles_of_a_cell_are_held_by_one_bar(built: Draft) -> None:
    asked, specimen = built("kagome")
    bases = {
        part.id: part.layers[1].area
        for part in fixtures(specimen, asked.fabrication, asked.lattice.spacing)
        if part.id.startswith(("CLAMP", "DRIVE")) and not part.id.endswith("LID")
    }
    assert len(bases) == 2
    for kind, labels in (("CLAMP", specimen.clamped), ("DRIVE", specimen.driven)):
        (base,) = (area for name, area in bases.items() if name.startswith(kind))
        assert len(labels) == 12
        for label in labels:
            outline = specimen.by_label[label].outline
            assert base.intersection(outline).area > 0.3 * outline.area
    assert shapely.intersection_all(list(bases.values())).is_empty


SLANTED = (("cell_angle: 90 deg", "cell_angle: 60 deg"), ("[45 mm, 45 mm]", "[66 mm, 38 mm]"))


@pytest.mark.parametrize(("ends", "angle"), [("left and right", 60.0), ("below and above", 0.0)])
def test_bars_run_along_the_sides_of_a_slanted_lattice(
    built: Draft, ends: str, angle: float
) -> None:
    asked, specimen = built("kagome", *SLANTED)
    if ends == "below and above":
        rows = [unit.row for unit in specimen.units]
        low, high = (
            tuple(unit.label for unit in specimen.units if unit.row == row)
            for row in (min(rows), max(rows))
        )
        assert len(low) == len(high) == 12
        specimen = replace(specimen, clamped=low, driven=high)
    bases, capped = plan_bases(specimen, asked.fabrication, asked.lattice.spacing)
    assert not capped
    held = [{unit.label for unit in base.held} for base in bases]
    assert held == [{*specimen.clamped}, {*specimen.driven}]
    one, other = (base.area for base in bases)
    assert one.distance(other) > asked.lattice.spacing
    for base in bases:
        corners = np.asarray(shapely.minimum_rotated_rectangle(base.area).exterior.coords)
        sides = np.diff(corners[:3], axis=0)
        x, y = sides[np.argmax(np.linalg.norm(sides, axis=1))]
        assert np.degrees(np.arctan2(y, x)) % 180.0 == pytest.approx(angle, abs=1e-6)
        for unit in base.held:
            assert base.area.intersection(unit.outline).area > 0.3 * unit.outline.area


def test_a_base_has_its_bolt_and_no_narrow_neck(built: Draft) -> None:
    """Even a pad that winds between units that move."""
    asked, specimen = built("kagome", *SLANTED)
    alone = [replace(specimen, clamped=(unit.label,), driven=()) for unit in specimen.units]
    bases = [
        base.area
        for each in alone[:20:2]
        for base in plan_bases(each, asked.fabrication, asked.lattice.spacing)[0]
    ]
    assert len(bases) == 9
    for area in bases:
        assert len(area.interiors) == 1
        inner = Polygon(area.exterior).buffer(-0.9)
        assert isinstance(inner, Polygon)
        assert not inner.is_empty


def test_units_of_a_list_are_grouped_by_where_they_are() -> None:
    """Those of a file of polygons are all in one row."""
    made = handmade.specimen()
    units = [replace(unit, column=n, row=0) for n, unit in enumerate(made.units)]
    listed = replace(made, units=tuple(units))
    left = [unit for unit in units if unit.design.centroid.x < handmade.SPACING / 2]
    edges, others = held_edges(units, listed, handmade.SPACING)
    assert len(edges) * 3 + len(others) == len(units)
    assert all(edge.along == (1.0, 0.0) for edge in edges)
    assert held_edges(left, listed, handmade.SPACING) == ([], left)
    assert np.ptp([unit.design.centroid.y for unit in edges[0].units]) < 1.0
    corners = [units[n] for n in (0, 2, 3, 5)]
    assert held_edges(corners, listed, handmade.SPACING) == ([], corners)


INNER = ("C4", "D4", "E4")


@pytest.mark.parametrize(
    ("clamped", "driven"), [(("D4",), ()), (INNER, ()), ((), INNER), ((), ("D3", *INNER))]
)
def test_inner_units_are_held_by_adapters(
    lattice: tuple[Problem, BuiltSpecimen], clamped: tuple[str, ...], driven: tuple[str, ...]
) -> None:
    """Their neighbours leave no room for a base with a bolt."""
    asked, whole = lattice
    specimen = replace(whole, clamped=clamped, driven=driven)
    made = fixtures(specimen, asked.fabrication, asked.lattice.spacing)
    holders = {part.id: part for part in made if not part.id.startswith("JIG")}
    kind = "CLAMP" if clamped else "DRIVE"
    assert list(holders) == [f"{kind}-{label}" for label in clamped + driven]
    for label in clamped + driven:
        back, foot = (layer.area for layer in holders[f"{kind}-{label}"].layers[:2])
        seen = affinity.scale(foot, xfact=-1.0, origin=(0.0, 0.0))
        unit = specimen.by_label[label].outline
        assert seen.intersection(unit).area > 0.8 * unit.area
        assert isinstance(back, Polygon)
        assert len(back.interiors) == 1
    backs = [part.layers[0].area for part in holders.values()]
    assert all(one.distance(other) > 0.4 for one, other in combinations(backs, 2))


@pytest.mark.parametrize(
    ("clamped", "driven"),
    [
        (("A1", "B1"), ()),
        (("A1",), ("B1",)),
        (("A1", "B1", "A2"), ()),
        (("A1", "B1", "C1"), ("A2",)),
    ],
)
def test_neighbours_are_held_side_by_side(
    lattice: tuple[Problem, BuiltSpecimen], clamped: tuple[str, ...], driven: tuple[str, ...]
) -> None:
    asked, whole = lattice
    specimen = replace(whole, clamped=clamped, driven=driven)
    bases, capped = plan_bases(specimen, asked.fabrication, asked.lattice.spacing)
    assert {unit.label for base in bases for unit in base.held} == {*clamped, *driven}
    assert not capped
    for one, other in combinations(bases, 2):
        assert one.area.distance(other.area) > 0.9


@pytest.mark.parametrize(
    "drives", [(("A1", "A2", "A3"), ("A4", "A5", "A6", "A7")), (("A1", "A2"), ("A3", "A4"))]
)
def test_no_bar_joins_units_of_different_drives(
    lattice: tuple[Problem, BuiltSpecimen], drives: tuple[tuple[str, ...], ...]
) -> None:
    asked, whole = lattice
    driven = tuple(label for group in drives for label in group)
    specimen = replace(whole, clamped=("G1", "G2", "G3"), driven=driven, drives=drives)
    bases, capped = plan_bases(specimen, asked.fabrication, asked.lattice.spacing)
    assert not capped
    held = [{unit.label for unit in base.held} for base in bases]
    assert set().union(*held) == {*driven, *specimen.clamped}
    for labels in held:
        assert sum(not labels.isdisjoint(group) for group in (specimen.clamped, *drives)) == 1


def test_all_pads_meet_one_breadboard(monkeypatch: pytest.MonkeyPatch) -> None:
    """On 5 x 8 units another shift of the board is nearer to those of a corner than of a side."""
    monkeypatch.setattr(handmade, "COLUMNS", 5)
    monkeypatch.setattr(handmade, "ROWS", 8)
    specimen = replace(handmade.specimen(), clamped=("A1", "E8"), driven=("A4", "E5"))
    bases, _ = plan_bases(specimen, handmade.ASKED, handmade.SPACING)
    bolts = [Polygon(ring).centroid.coords[0] for base in bases for ring in base.area.interiors]
    assert len(bolts) == len(bases) == 4
    steps = np.subtract(bolts, bolts[0]) / handmade.ASKED.fixture.grid
    assert np.abs(steps - np.round(steps)).max() < 1e-6


@pytest.mark.parametrize("thickness", [1.4, 3.0])
def test_no_wall_stands_where_thick_shims_go(
    thickness: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = Fabrication.model_validate({"shims": {"thickness": thickness}}, context=SIM_UNITS)
    monkeypatch.setattr(handmade, "ASKED", asked)
    specimen = handmade.specimen()
    mouths: dict[int, list[Floats]] = {}
    for slot in (slot for unit in specimen.units for slot in unit.slots):
        mouths.setdefault(slot.ligament, []).extend([slot.end, slot.mouth])
    ways = [LineString([ends[0], ends[1], ends[3], ends[2]]) for ends in mouths.values()]
    shims = shapely.union_all(shapely.buffer(ways, thickness / 2, cap_style="flat"))
    made = [part for part in fixtures(specimen, asked, handmade.SPACING) if "LID" not in part.id]
    assert [part.id for part in made] == ["CLAMP-A1", "CLAMP-C2", "JIG1"]
    for part in made:
        walls = part.layers[-1].area
        assert walls.area > 10.0
        assert walls.intersection(shims).area < 1e-6


def test_every_plate_of_a_jig_has_its_name_below() -> None:
    """Its rim is a wall, which letters in its floor do not reach."""
    given = {"print": {"bed": ["45 mm", "60 mm"]}}
    asked = Fabrication.model_validate(given, context=SIM_UNITS)
    made = fixtures(handmade.specimen(), asked, handmade.SPACING)
    plates = [part for part in made if part.id.startswith("JIG")]
    assert len(plates) > 1
    below = []
    for part in plates:
        box = shapely.box(*part.bounds)
        below.append(box.difference(part.layers[0].area).area)
        assert part.layers[1].area.equals(box)
    assert min(below) > 2.0
    assert len({round(area, 3) for area in below}) == len(below)


@pytest.mark.parametrize(("depth", "base"), [(3.0, 0.4), (2.5, 0.3), (0.4, 0.4), (0.4, 4.0)])
def test_letters_take_half_of_a_thin_base_at_most(depth: float, base: float) -> None:
    given = {"labels": {"depth": depth}, "fixture": {"base": base}}
    asked = Fabrication.model_validate(given, context=SIM_UNITS)
    made = list(fixtures(handmade.specimen(), asked, handmade.SPACING))
    for part in made:
        assert part.layers[0].bottom == 0.0
        assert all(layer.top > layer.bottom for layer in part.layers)
        assert all(below.top == above.bottom for below, above in pairwise(part.layers))
    (clamp,) = (part for part in made if part.id == "CLAMP-A1")
    assert clamp.layers[0].top == min(depth, base / 2)
    assert clamp.layers[1].top == base


@pytest.mark.parametrize("thickness", [0.1, 0.2, 0.5, 8.1])
def test_jaws_stand_lower_than_the_units_and_higher_than_the_base(thickness: float) -> None:
    given = {"thickness": thickness, "labels": {"depth": 0.05}}
    asked = Fabrication.model_validate(given, context=SIM_UNITS)
    made = {part.id: part for part in fixtures(handmade.specimen(), asked, handmade.SPACING)}
    jaws, base = made["CLAMP-A1"].layers[-1], asked.fixture.base
    assert base + 0.4 * thickness < jaws.top < base + thickness


@pytest.mark.parametrize("name", ["fig4"])
def test_columns_of_squares_are_held_as_they_were(name: str, built: Draft) -> None:
    _, specimen = built(name)
    held = [specimen.by_label[label] for label in specimen.clamped]
    (edge,), others = held_edges(held, specimen, 15.0)
    assert not others
    assert edge.along == (0.0, 1.0)
    assert {unit.column for unit in edge.units} == {0}


@pytest.mark.parametrize(("pocket", "thickness", "depth"), [(2.0, 8.1, 2.0), (4.0, 3.0, 3.0)])
def test_pockets_of_the_jig_are_as_deep_as_asked_for(
    pocket: float, thickness: float, depth: float
) -> None:
    given = {"fixture": {"pocket": pocket}, "thickness": thickness}
    asked = Fabrication.model_validate(given, context=SIM_UNITS)
    made = {part.id: part for part in fixtures(handmade.specimen(), asked, handmade.SPACING)}
    walls = made["JIG1"].layers[-1]
    assert walls.top - walls.bottom == pytest.approx(depth)
