import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from pipeline.problem import (
    canonical_json,
    cloak_units,
    content_hash,
    from_canonical,
    interest_units,
    void_units,
)
from pipeline.problem.outlines import Outline, extents, find_inside, read_outlines
from pipeline.problem.reading import load
from pipeline.runtime import UserError
from tests.pipeline.static import MIMIC, write
from tests.tables import cases, refused

SHAPES = Path(__file__).parents[3] / "experiments/shapes"
CLOAK = "cloak: { disc: { radius: 175 mm } }\n"
MIDDLE = (217.5, 217.5)

Placed = Callable[..., tuple[Outline, ...]]


@pytest.fixture
def placed(tmp_path: Path) -> Placed:
    """The outlines (mm) of a void in a lattice of 30 x 30 units."""

    def outlines(void: str) -> tuple[Outline, ...]:
        problem = load(write(tmp_path, f"void: {{ {void} }}\n{CLOAK}{MIMIC}", 30))
        assert problem.void is not None
        return problem.void.outlines(problem.lattice.centre_site)

    return outlines


def box(outlines: tuple[Outline, ...]) -> tuple[np.ndarray, np.ndarray]:
    points = np.array([point for outline in outlines for point in outline])
    return points.min(axis=0), points.max(axis=0)


def draw(path: Path, flip: bool = False) -> Path:
    """An L of 40 x 60 pixels, its foot to the right."""
    image = np.full((100, 100), 255, np.uint8)
    image[20:80, 30:45] = 0
    image[65:80, 30:70] = 0
    cv2.imwrite(str(path), image[::-1] if flip else image)
    return path


@pytest.mark.parametrize("kind", ["white on black", "white on nothing", "yellow on blue"])
def test_a_light_or_coloured_shape_is_read_as_a_dark_one(kind: str, tmp_path: Path) -> None:
    dark = draw(tmp_path / "l.png")
    shape = np.asarray(cv2.imread(str(dark), cv2.IMREAD_GRAYSCALE)) == 0
    colours = np.zeros((*shape.shape, 4 if kind == "white on nothing" else 3), np.uint8)
    asked: dict[str, float] = {}
    if kind == "yellow on blue":  # mean levels of 156 and 85, neither dark nor light
        colours[...], colours[shape], asked = (255, 0, 0), (14, 201, 255), {"threshold": 0.5}
    else:
        colours[shape] = 255
    cv2.imwrite(str(tmp_path / "light.png"), colours)
    if asked:
        with refused("not binary", remedy="threshold"):
            read_outlines(tmp_path / "light.png")
    assert read_outlines(tmp_path / "light.png", invert=True, **asked) == read_outlines(dark)


@pytest.mark.parametrize("marked", [1, 2, 3, 4, 5, 6, 7, 8])
def test_a_photograph_is_read_upright(marked: int, tmp_path: Path) -> None:
    """A phone stores the sensor's rows, and in EXIF how to turn them."""
    upright = np.asarray(cv2.imread(str(draw(tmp_path / "l.png")), cv2.IMREAD_GRAYSCALE))
    stored = {
        1: upright,
        2: upright[:, ::-1],
        3: upright[::-1, ::-1],
        4: upright[::-1],
        5: upright.T,
        6: upright.T[::-1],
        7: upright.T[::-1, ::-1],
        8: upright.T[:, ::-1],
    }[marked]
    entry = (0x0112).to_bytes(2) + (3).to_bytes(2) + (1).to_bytes(4) + marked.to_bytes(2) + b"\0\0"
    exif = b"Exif\0\0MM\0*" + (8).to_bytes(4) + (1).to_bytes(2) + entry + bytes(4)
    photograph = cv2.imencode(".jpg", np.ascontiguousarray(stored))[1].tobytes()
    path = tmp_path / "l.jpg"
    segment = b"\xff\xe1" + (2 + len(exif)).to_bytes(2) + exif
    path.write_bytes(photograph[:2] + segment + photograph[2:])
    seen = read_outlines(path)
    np.testing.assert_allclose(box(seen), [[30, -79], [69, -20]], atol=1.5)
    stem_foot_and_neither = [(37.0, -30.0), (60.0, -72.0), (60.0, -30.0)]
    assert find_inside(stem_foot_and_neither, seen, 1e-9) == [True, True, False]


@cases("problem", "drawn, what")
def test_text_and_open_strokes_are_to_be_converted(drawn: str, what: str, tmp_path: Path) -> None:
    path = tmp_path / "my logo.svg"
    square = '<path fill="none" stroke="black" d="M0 0 H9 V9 H0 Z"/>'
    head = '<svg xmlns="http://www.w3.org/2000/svg" width="20" height="20">'
    path.write_text(f"{head}{square}</svg>")
    assert len(read_outlines(path)) == 1
    path.write_text(f"{head}{square}{drawn}</svg>")
    with refused(what, remedy="to paths"):
        read_outlines(path)


@cases("problem", "drawn, inside")
def test_fills_that_overlap_are_one(drawn: str, inside: list[bool], tmp_path: Path) -> None:
    """At the middle, beside it, and in a corner."""
    path = tmp_path / "l.svg"
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg">{drawn}</svg>')
    points = [(20.0, -20.0), (7.0, -20.0), (2.0, -2.0)]
    assert find_inside(points, read_outlines(path), 1e-9) == inside


@pytest.mark.parametrize(
    ("drawn", "inside"),
    [
        ("M0 0h40v40H0zM10 10h20v20H10z", True),  # wound twice
        ("M0 0h40v40H0zM10 10v20h20V10z", False),  # once either way
        ('M0 0h40v40H0zM10 10h20v20H10z" fill-rule="evenodd', False),
        ('M0 0h40v40H0zM10 10h20v20H10z" style="fill-rule: evenodd', False),
        ("M0 0h40v40H0zh40v40H0z", True),
    ],
)
def test_a_fill_has_the_holes_of_its_rule(drawn: str, inside: bool, tmp_path: Path) -> None:
    """Draws a square in a square, of which the middle is or is not filled."""
    path = tmp_path / "l.svg"
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg"><path d="{drawn}"/></svg>')
    points = [(20.0, -20.0), (7.0, -20.0), (50.0, -2.0)]
    assert find_inside(points, read_outlines(path), 1e-9) == [inside, True, False]


def test_a_fill_that_crosses_itself_without_end_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "star.svg"
    angle = 2 * np.pi * 400 / 801 * np.arange(801)
    corners = " ".join(f"{x:.6f},{y:.6f}" for x, y in np.stack([np.cos(angle), np.sin(angle)], 1))
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg"><polygon points="{corners}"/></svg>')
    with refused("a fill crosses itself too often"):
        read_outlines(path)


DEFINED = (
    '<defs><clipPath id="a"><rect x="1" y="1" width="9.5" height="9.5"/></clipPath>'
    '<clipPath id="b" clip-path="url(#a)"><rect width="20" height="20"/></clipPath>'
    '<linearGradient id="g"><stop stop-color="#fff"/></linearGradient></defs>'
)


@cases("problem", "drawn, what")
def test_what_outlines_do_not_tell_is_refused(drawn: str, what: str, tmp_path: Path) -> None:
    path = tmp_path / "l.svg"
    head = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 20 20" width="40" height="40">'
    path.write_text(f"{head}{drawn}{DEFINED}</svg>")
    with refused(what, remedy="Inkscape"):
        read_outlines(path)


@cases("problem", "drawn")
def test_what_changes_no_outline_is_read(drawn: str, tmp_path: Path) -> None:
    """Draws a square that a clip leaves whole, or beside which what is hidden needs no outline."""
    path = tmp_path / "l.svg"
    head = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 20 20" width="40" height="40">'
    path.write_text(f"{head}{drawn}{DEFINED}</svg>")
    assert extents(read_outlines(path)[0]) == pytest.approx((18.0, 18.0))


@cases("problem", "hidden")
def test_what_is_not_seen_is_no_shape(hidden: str, tmp_path: Path) -> None:
    """As the frame of an icon: it is seen neither before nor after what is."""
    path = tmp_path / "l.svg"
    head = '<svg xmlns="http://www.w3.org/2000/svg" width="24" height="24">'
    kite = '<path d="M12 2 L20 9 L12 22 L4 9 Z"/>'
    path.write_text(f"{head}{kite}</svg>")
    alone = read_outlines(path)
    for drawn in (hidden + kite, kite + hidden):
        path.write_text(f"{head}{drawn}</svg>")
        assert read_outlines(path) == alone


def test_a_symbol_is_seen_where_it_is_used(tmp_path: Path) -> None:
    path = tmp_path / "l.svg"
    square = '<symbol id="a"><rect width="9" height="9"/></symbol><use href="#a" x="10"/>'
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg">{square}</svg>')
    np.testing.assert_allclose(box(read_outlines(path)), [[10, -9], [19, 0]])


GROUND = '<rect width="100" height="100" fill="{}"/>'
LETTER = '<path fill="{}" d="M30 20 h15 v45 h25 v15 h-40 z"/>'


@cases("problem", "ground, over, asked")
def test_a_drawing_is_read_by_its_colours(
    ground: str, over: str, asked: dict[str, Any], tmp_path: Path
) -> None:
    """An L over a ground, and a light mark over the L and beyond it."""
    path = tmp_path / "l.svg"
    head = '<svg xmlns="http://www.w3.org/2000/svg" width="100" height="100">'
    mark = f'<rect x="25" y="65" width="15" height="30" fill="{ground}"/>'
    path.write_text(f"{head}{GROUND.format(ground)}{LETTER.format(over)}{mark}</svg>")
    (drawn,) = read_outlines(path, **asked)
    assert set(drawn) == {
        *((30.0, -20.0), (45.0, -20.0), (45.0, -65.0), (70.0, -65.0)),
        *((70.0, -80.0), (40.0, -80.0), (40.0, -65.0), (30.0, -65.0)),
    }
    path.write_text(f"{head}{GROUND.format(ground)}</svg>")
    with refused("the image shows no shape", remedy="invert: true"):
        read_outlines(path, **asked)


@cases("problem", "name, size, x0")
def test_images_of_studies(placed: Placed, tmp_path: Path, name: str, size: int, x0: float) -> None:
    asked = f"size: [{size} mm, {size} mm], centre: [{x0} mm, 221.25 mm]"
    low, high = box(placed(f"image: {{ file: {SHAPES / name}, {asked} }}, loose: remove"))
    np.testing.assert_allclose((low + high) / 2, [x0, 221.25])
    np.testing.assert_allclose(high - low, size)
    problem = load(tmp_path / "problem.yaml")
    assert 60 < len(void_units(problem)) < 190
    assert len(cloak_units(problem)) > 200


def test_what_a_void_cuts_loose_can_go_too(tmp_path: Path) -> None:
    ring = "void: { ring: { inner: 20 mm, outer: 50 mm }, loose: remove }\n"
    loose = load(write(tmp_path, f"{ring}{CLOAK}{MIMIC}", 30))
    whole = load(write(tmp_path, f"void: {{ disc: {{ radius: 50 mm }} }}\n{CLOAK}{MIMIC}", 30))
    assert void_units(loose) == void_units(whole)


def test_pictures_keep_their_proportions_and_turn(placed: Placed, tmp_path: Path) -> None:
    (shape,) = placed(f"image: {{ file: {draw(tmp_path / 'l.png').name}, width: 80 mm }}")
    assert extents(shape) == pytest.approx((80.0, 80 * 59 / 39), rel=0.02)
    points = np.array(shape)
    foot = points[points[:, 1] < MIDDLE[1] - 40]
    assert np.ptp(foot[:, 0]) == pytest.approx(80.0)
    assert np.ptp(points[points[:, 1] > MIDDLE[1] + 20][:, 0]) < 35
    given = f"file: {draw(tmp_path / 'l.png').name}, width: 80 mm, centre: [200 mm, 210 mm]"
    upright = placed(f"image: {{ {given} }}")
    turned = placed(f"image: {{ {given}, orientation: 90 deg }}")
    x, y = (np.array(upright[0]) - [200, 210]).T
    np.testing.assert_allclose(np.array(turned[0]), np.stack([200 - y, 210 + x], axis=1))
    path = "M30 20 h15 v45 h25 v15 h-40 z"
    svg = tmp_path / "l.svg"
    svg.write_text(f'<svg xmlns="http://www.w3.org/2000/svg"><path d="{path}"/></svg>')
    (drawn,) = placed("image: { file: l.svg, width: 80 mm }")
    assert extents(drawn) == pytest.approx((80.0, 120.0))
    corner = np.array(drawn)[np.argmax(np.array(drawn) @ [1, -1])]
    np.testing.assert_allclose(corner, [MIDDLE[0] + 40, MIDDLE[1] - 60])


def test_holes_are_no_part_of_the_shape(tmp_path: Path) -> None:
    image = draw(tmp_path / "ring.png")
    pixels = np.full((90, 90), 255, np.uint8)
    cv2.circle(pixels, (45, 45), 40, 0, -1)
    cv2.circle(pixels, (45, 45), 30, 255, -1)
    cv2.imwrite(str(image), pixels)
    void = "void: { image: { file: ring.png, width: 240 mm } }\n"
    with pytest.raises(UserError, match="splits the lattice"):
        load(write(tmp_path, f"{void}{CLOAK}{MIMIC}", 30))


def test_curves(placed: Placed) -> None:
    (heart,) = placed("curve: { kind: heart, size: [270 mm, 198 mm], centre: [225 mm, 221.25 mm] }")
    formula = (
        'curve: { kind: formula, x: "16 sin(t)^3", y: "13 * cos(t) - 5 * cos(2 * t)'
        ' - 2 * cos(3 * t) - cos(4 * t)", size: [270 mm, 198 mm], centre: [225 mm, 221.25 mm],'
        " points: 49 }"
    )
    (same,) = placed(formula.replace("16 sin", "16 * sin"))
    assert len(heart) == 50
    np.testing.assert_allclose(np.array(same), np.array(heart)[:49], atol=1e-9)
    (polygon,) = placed(
        "polygon: { vertices: [[100 mm, 100 mm], [140 mm, 100 mm], [120 mm, 130 mm]],"
        " orientation: 180 deg }"
    )
    np.testing.assert_allclose(polygon, [(140, 130), (100, 130), (120, 100)])


def test_a_cloak_around_the_void(tmp_path: Path) -> None:
    disc = "void: { disc: { radius: 40 mm } }\n"
    around = load(write(tmp_path, f"{disc}cloak: {{ around: {{ distance: 50.1 mm }} }}\n{MIMIC}"))
    round_one = load(write(tmp_path, f"{disc}cloak: {{ disc: {{ radius: 90 mm }} }}\n{MIMIC}"))
    assert cloak_units(around) == cloak_units(round_one)


def test_a_cloak_leaves_units_that_a_design_can_move(tmp_path: Path) -> None:
    """Driven units move as the drive does: a loss over them alone is zero."""
    wide = "void: { disc: { radius: 40 mm } }\ncloak: { around: { distance: 1 m } }\n"
    with refused("prescribe the motion of all units of interest", "cloak", "outside it"):
        load(write(tmp_path, wide + MIMIC))
    path = write(tmp_path, wide + MIMIC)
    text = path.read_text()
    path.write_text(text.replace("  directions", "  free: [uy]\n  directions"))
    assert len(interest_units(load(path))) == 15
    path.write_text(text.replace("intact", "intact, reaction: 1"))
    assert load(path).objective.reaction == 1.0


def test_the_problem_holds_what_the_image_showed(tmp_path: Path) -> None:
    image = draw(tmp_path / "l.png")
    void = "void: { image: { file: l.png, width: 80 mm } }\n"
    path = write(tmp_path, f"{void}{CLOAK}{MIMIC}", 30)
    problem = load(path)
    draw(image, flip=True)
    assert content_hash(load(path)) != content_hash(problem)
    image.unlink()
    again = from_canonical(canonical_json(problem))
    assert content_hash(again) == content_hash(problem)
    assert void_units(again) == void_units(problem)


@cases("problem", "name, what")
def test_a_bad_image_is_told(tmp_path: Path, name: str, what: str) -> None:
    for file, row in (("grey.png", np.arange(256)), ("blank.png", np.full(64, 255))):
        cv2.imwrite(str(tmp_path / file), np.tile(row.astype(np.uint8), (64, 1)))
    for text in ("text.png", "text.svg"):
        (tmp_path / text).write_text("no image")
    path = write(
        tmp_path, f"void: {{ image: {{ file: {name}, width: 9 mm }} }}\n{CLOAK}{MIMIC}", 30
    )
    with refused(what, "void.image.file") as caught:
        load(path)
    assert caught.value.value == name


@cases("problem", "x, what", ["t" + " + 0" * 150 + " + 5 * sin(t)", "longer than 500 letters"])
def test_a_bad_formula_is_told(tmp_path: Path, x: str, what: str) -> None:
    curve = f'curve: {{ kind: formula, x: "{x}", y: "sin(t)", size: [9 mm, 9 mm] }}'
    with refused(what, "void.curve.x"):
        load(write(tmp_path, f"void: {{ {curve} }}\n{CLOAK}{MIMIC}", 30))


def test_points_on_the_rim_are_inside() -> None:
    square = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))
    points = [(1.0, 0.0), (0.0, 0.0), (2.0, 1.0), (1.0, 1.0), (2.1, 1.0), (1.0, math.nan)]
    assert find_inside(points, (square,), 1e-9) == [True, True, True, True, False, False]
