"""Every way in which a drawing can be wrong is made in a file, and found there."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.fabrication.checks.sheet_checks import check_compensation, check_curves, check_sheet
from pipeline.fabrication.readback import Curve, Drawing, read_drawing
from pipeline.problem.sections import Laser
from pipeline.runtime import UserError
from tests.pipeline.fabrication.files import rectangle, sheet, stroke, write_dxf, write_svg
from tests.tables import cases

SIZE = (100.0, 60.0)
LASER = Laser.model_construct(kerf=0.2, sheet=SIZE, margin=5.0, gap=2.0, template_thickness=1.5)
THICKNESS = 4.0
REFERENCE, LETTER, HOLE, OUTER = 0, 1, 3, 4  # places in the sheet of two plates
OTHER = 8

Damage = Callable[[list[Curve]], list[Curve]]


def found(drawing: Drawing) -> list[str]:
    faults = [*check_curves(drawing), *check_sheet(drawing, LASER, THICKNESS)]
    return [f"{fault.part}: {fault.what}" for fault in faults]


def changed(place: int, **values: object) -> Damage:
    def damage(kept: list[Curve]) -> list[Curve]:
        kept[place] = replace(kept[place], **values)  # type: ignore[arg-type]
        return kept

    return damage


def moved(place: int, x: float, y: float = 0.0) -> Damage:
    return lambda kept: changed(place, points=np.add(kept[place].points, [x, y]))(kept)


def reordered(*order: int) -> Damage:
    return lambda kept: changed(OUTER, points=kept[OUTER].points[list(order)])(kept)


def outer_first(kept: list[Curve]) -> list[Curve]:
    kept[HOLE], kept[OUTER] = kept[OUTER], kept[HOLE]
    return kept


def shrunk(place: int, factor: float) -> Damage:
    def damage(kept: list[Curve]) -> list[Curve]:
        points = kept[place].points
        middle = points.mean(axis=0)
        return changed(place, points=middle + factor * (points - middle))(kept)

    return damage


DAMAGES: dict[str, tuple[Damage, str]] = {
    "empty": (lambda kept: kept[:0], "nothing is drawn"),
    "open": (changed(OUTER, closed=False), "part A1: an open curve on layer CUT_OUTER"),
    "bow tie": (reordered(0, 2, 1, 3), "part A1: a cut that crosses or repeats itself"),
    "zero length": (reordered(0, 0, 1, 2, 3), "part A1: a segment of no length"),
    "spline": (changed(OUTER, kind="SPLINE"), "part A1: a SPLINE on layer CUT_OUTER"),
    "text": (changed(LETTER, kind="TEXT"), "part A1: a TEXT on layer ENGRAVE"),
    "layer 0": (changed(OUTER, layer="0"), "a layer of name '0'"),
    "own colour": (changed(OUTER, own_colour=True), "with a colour of its own"),
    "no part": (changed(OUTER, part=""), "an outer cut that belongs to no part"),
    "hole outside": (moved(HOLE, 15.0, 20.0), "part A1: an inner cut outside of A1"),
    "hole across": (moved(HOLE, 7.0), "part A1: a cut meets one of A1"),
    "drawn twice": (lambda kept: [*kept, kept[OUTER]], "part A1: a cut meets one of A1"),
    "parts cross": (moved(OTHER, -12.0), "part A1: a cut meets one of B1"),
    "parts too near": (moved(OTHER, -9.0), "part A1: 1.000 mm from part B1"),
    "outer first": (outer_first, "part A1: an inner cut comes after the outer one"),
    "off the sheet": (moved(OTHER, 38.0), "part B1: it does not lie on the sheet less its margin"),
    "sheet grown": (changed(REFERENCE, points=rectangle(0, 0, 100.1, 60, "").points), "it spans"),
    "inches": (lambda kept: [replace(c, points=c.points / 25.4) for c in kept], "it spans 0.000"),
    "small hole": (shrunk(HOLE, 0.94), "a hole 3.96 mm wide in material of 4 mm"),
    "small letters": (
        lambda kept: shrunk(LETTER + 1, 0.4)(shrunk(LETTER, 0.4)(kept)),
        "letters of 1.",
    ),
    "letters outside": (moved(LETTER, -3.0), "part A1: engraving beyond its outline"),
    "line twice": (
        lambda kept: [*kept, stroke([(12.0, 15.0), (12.0, 17.0)], "A1")],
        "a line twice on layer ENGRAVE",
    ),
}


NOT_IN_SVG = ("spline", "text", "own colour", "layer 0", "letters outside", "small letters")


@pytest.mark.parametrize("suffix", [".dxf", ".svg"])
def test_a_right_drawing_passes(tmp_path: Path, suffix: str) -> None:
    assert found(drawn(tmp_path / f"sheet{suffix}", sheet())) == []


def drawn(path: Path, kept: list[Curve]) -> Drawing:
    if path.suffix == ".svg":
        return read_drawing(write_svg(path, kept, SIZE))
    return read_drawing(write_dxf(path, kept))


@pytest.mark.parametrize(
    ("name", "suffix"),
    [
        (name, suffix)
        for name in DAMAGES
        for suffix in (("dxf",) if name in NOT_IN_SVG else ("dxf", "svg"))
    ],
)
def test_a_damaged_drawing_is_caught(tmp_path: Path, name: str, suffix: str) -> None:
    damage, expected = DAMAGES[name]
    told = found(drawn(tmp_path / f"sheet.{suffix}", damage(sheet())))
    assert any(expected in words for words in told), told


def test_other_ids_units_colours_and_text_are_caught(tmp_path: Path) -> None:
    bare = [curve for curve in sheet() if curve.layer != "ENGRAVE"]
    told = [f"part {name}: no id is engraved on it" for name in ("A1", "B1")]
    assert found(drawn(tmp_path / "units_1.dxf", bare)) == told
    swapped = {"A1": "B1", "B1": "A1"}
    other = [replace(c, part=swapped[c.part]) if c.layer == "ENGRAVE" else c for c in sheet()]
    told = [f"part {name}: engraving beyond its outline" for name in ("B1", "A1")]
    assert found(drawn(tmp_path / "units_2.dxf", other)) == told
    drawing = read_drawing(write_dxf(tmp_path / "sheet.dxf", sheet(), units=1))
    assert found(drawing) == ["the drawing: $INSUNITS is 1, not 4 (millimetres)"]
    path = write_dxf(tmp_path / "sheet.dxf", sheet(), colours={"CUT_INNER": 1})
    assert "layers CUT_INNER and CUT_OUTER have one colour" in found(read_drawing(path))[0]
    path = write_svg(tmp_path / "sheet.svg", sheet(), SIZE)
    path.write_text(path.read_text().replace("</svg>", '<text x="3" y="9">A1</text></svg>'))
    assert any("a TEXT on layer" in words for words in found(read_drawing(path)))


@cases("fabrication", "head")
def test_an_svg_of_another_scale_is_caught(tmp_path: Path, head: str) -> None:
    drawing = read_drawing(write_svg(tmp_path / "sheet.svg", sheet(), SIZE, head))
    assert any("the page does not say" in words for words in found(drawing))


def test_the_old_format_holds_the_same_curves(tmp_path: Path) -> None:
    old = [replace(c, kind="POLYLINE") for c in sheet()]
    first = read_drawing(write_dxf(tmp_path / "new.dxf", sheet()))
    second = read_drawing(write_dxf(tmp_path / "old.dxf", old, version="R12"))
    assert second.version == "AC1009"
    for mine, other in zip(first.curves, second.curves, strict=True):
        assert (mine.part, mine.layer, mine.closed) == (other.part, other.layer, other.closed)
        np.testing.assert_allclose(mine.points, other.points, atol=1e-9)


def grown(curve: Curve, kerf: float) -> Curve:
    """The cut with its corners moved out, or in if it is an inner one."""
    shift = {"CUT_OUTER": kerf / 2, "CUT_INNER": -kerf / 2}.get(curve.layer, 0.0)
    middle = curve.points.mean(axis=0)
    return replace(curve, points=curve.points + shift * np.sign(curve.points - middle))


@pytest.mark.parametrize(("kerf", "faults"), [(0.2, 0), (0.1, 4), (0.0, 4), (-0.2, 4)])
def test_compensation_for_the_kerf_is_measured(tmp_path: Path, kerf: float, faults: int) -> None:
    nominal = drawn(tmp_path / "nominal.dxf", sheet())
    cut = drawn(tmp_path / "cut.dxf", [grown(curve, kerf) for curve in sheet()])
    told = [fault.what for fault in check_compensation([cut], [nominal], 0.2)]
    assert len(told) == faults
    assert all(words.endswith("of the nominal cut") for words in told)
    (fault,) = check_compensation([drawn(tmp_path / "less.dxf", sheet()[:-1])], [nominal], 0.2)
    assert "other parts than at nominal size" in fault.what


def test_a_hole_that_is_moved_for_the_kerf_is_found(tmp_path: Path) -> None:
    nominal = drawn(tmp_path / "nominal.dxf", sheet())
    curves = [grown(curve, 0.2) for curve in sheet()]
    for place, curve in enumerate(curves):
        if curve.layer == "CUT_INNER" and curve.part == "A1":
            curves[place] = replace(curve, points=np.add(curve.points, [1.5, 0.7]))
    (fault,) = check_compensation([drawn(tmp_path / "cut.dxf", curves)], [nominal], 0.2)
    assert fault.what == "not 0.1 mm in of the nominal cut"


@pytest.mark.parametrize("name", ["sheet.dxf", "sheet.svg"])
@pytest.mark.parametrize("content", [b"", b"junk", None])
def test_what_is_no_drawing_is_refused(tmp_path: Path, name: str, content: bytes | None) -> None:
    path = tmp_path / name
    if content is None:  # the first half of a right one
        drawn(path, sheet())
        content = path.read_bytes()[: path.stat().st_size // 2]
    path.write_bytes(content)
    with pytest.raises(UserError, match="cannot be read back"):
        read_drawing(path)
