import hashlib
import json
import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from pipeline.posing import scene_of
from pipeline.problem import (
    SWITCHES,
    Problem,
    canonical_json,
    cloak_units,
    content_hash,
    from_canonical,
    interest_units,
    outputs,
    section_hash,
)
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.reading import load, overlay_keys, preset_names
from pipeline.problem.sections import Fabrication, LinearRampDrive, Quads
from pipeline.runtime import ROOT
from tests.pipeline import static
from tests.pipeline.conftest import Refusal
from tests.tables import cases, refused

ROBUST = ("broadband", "worst", "amplitudes", "tolerant", "pulse")
UNBIASED = (
    "unbiased", "unbiased_share", "unbiased_size", "unbiased_edge", "unbiased_angle",
    "unbiased_free", "fastest", "unbiased_as_built",
)  # fmt: skip
NAMES = ("edge3", "free", "text", *ROBUST, *UNBIASED, "as_built", "robust", "quick")
PRESETS = (None, *NAMES)


def edited(fig2: Path, folder: Path, old: str, new: str) -> Problem:
    text = fig2.read_text(encoding="utf-8")
    assert old in text
    path = folder / "problem.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return load(path)


def test_fig2_is_as_the_authors_ran_it(fig2: Path) -> None:
    problem = load(fig2)
    assert problem.lattice.ligament_length == 0.15 * problem.lattice.spacing
    assert isinstance(problem.lattice, Quads)
    assert problem.lattice.edge_length == pytest.approx(9.594, abs=1e-3)
    assert problem.horizon_time == 1.0
    assert problem.material.density == 6.18e-9
    assert problem.damping_coefficients == pytest.approx((2.876e-5, 1.19e-4), rel=2e-3)
    assert [math.degrees(angle) for angle in problem.drive.directions] == [0.0, 45.0, 90.0, 135.0]  # type: ignore[union-attr]
    assert problem.drive.case_weights == (0.25,) * 4
    assert len(cloak_units(problem)) == 68
    assert len(interest_units(problem)) == 156
    assert 112 not in {*cloak_units(problem), *interest_units(problem)}
    wave = load(ROOT / "experiments/fig7/problem.yaml")
    assert ["verification" in outputs(each) for each in (problem, wave)] == [False, True]


def test_presets_change_what_they_name(fig2: Path) -> None:
    assert preset_names(fig2) == NAMES
    assert load(fig2, "edge3").constraints.edge_length == 3.0
    assert load(fig2, "edge3").constraints.block_angle == load(fig2).constraints.block_angle
    text = load(fig2, "text")
    assert text.lattice.ligament_length == 2.3
    assert text.damping_coefficients == pytest.approx((2.9e-5, 1.2e-4))
    assert len(cloak_units(text)) == 48
    assert load(fig2, "quick").solver.accuracy == "draft"


@pytest.mark.parametrize("preset", PRESETS)
def test_canonical_text_restores_the_problem(fig2: Path, preset: str | None) -> None:
    problem = load(fig2, preset)
    assert from_canonical(canonical_json(problem)) == problem
    assert content_hash(from_canonical(canonical_json(problem))) == content_hash(problem)
    assert from_canonical(canonical_json(problem, "design", "sqp")).optimiser.methods.mma is None


def test_comments_spelling_and_order_do_not_change_the_hash(fig2: Path, tmp_path: Path) -> None:
    old = "  spacing: 15 mm\n  ligament_length: 2.25 mm"
    new = "  ligament_length: 0.225 cm # as run\n  spacing: 0.015 m"
    assert content_hash(edited(fig2, tmp_path, old, new)) == content_hash(load(fig2))


@cases("problem", "old, new, changed")
def test_a_key_changes_the_stages_that_depend_on_it(
    fig2: Path, tmp_path: Path, old: str, new: str, changed: list[str]
) -> None:
    before, after = load(fig2), edited(fig2, tmp_path, old, new)
    stages = ("design", "simulate", "sweep")
    found = [s for s in stages if section_hash(before, s) != section_hash(after, s)]
    assert found == changed
    assert section_hash(before, "report") != section_hash(after, "report")


def test_a_method_depends_on_its_own_budget(fig2: Path, tmp_path: Path) -> None:
    before, after = load(fig2), edited(fig2, tmp_path, "evaluations: 60", "evaluations: 61")
    assert section_hash(before, "design", "sqp") == section_hash(after, "design", "sqp")
    assert section_hash(before, "design", "mma") != section_hash(after, "design", "mma")


mappings = st.recursive(
    st.integers() | st.text(max_size=3),
    lambda inner: st.dictionaries(st.sampled_from("abc"), inner, max_size=3),
).filter(lambda value: isinstance(value, dict))


@given(mappings, mappings)
def test_overlays_win_idempotently(base: dict[str, object], overlay: dict[str, object]) -> None:
    assert overlay_keys(base, {}) == base
    once = overlay_keys(base, overlay)
    assert overlay_keys(once, overlay) == once
    assert set(once) == set(base) | set(overlay)


def test_null_removes_a_key() -> None:
    assert overlay_keys({"a": {"b": 1, "c": 2}}, {"a": {"b": None}}) == {"a": {"c": 2}}


@pytest.mark.parametrize(
    ("own", "laid"), [("direction", "directions"), ("directions", "direction")]
)
def test_a_direction_takes_the_place_of_directions(own: str, laid: str, tmp_path: Path) -> None:
    """In a preset that gives one of the two."""
    path = static.write(tmp_path, static.HOLE, size=5)
    content = yaml.safe_load(path.read_text())
    before, after = ({"direction": each, "directions": [each]} for each in ("180 deg", "90 deg"))
    del content["drive"]["directions"]
    content["drive"][own] = before[own]
    content["presets"] = {"up": {"drive": {laid: after[laid]}}, "both": {"drive": before}}
    path.write_text(json.dumps(content))
    drive = load(path, "up").drive
    assert isinstance(drive, LinearRampDrive)
    assert drive.directions == (math.radians(90.0),)
    with refused("direction and directions exclude each other", remedy="one of them"):
        load(path, "both")


def test_null_turns_off_what_is_on_by_default(fig2: Path, tmp_path: Path) -> None:
    """In the file and in a preset; and what is off stays so in the problem that a file holds."""
    content = yaml.safe_load(fig2.read_bytes())
    alone = {"together": None, "geometry": [0.03]}
    off = {"robustness": alone, "fabrication": {"shims": {"tabs": None}}}
    path = tmp_path / "problem.yaml"
    path.write_text(yaml.safe_dump(content | {"presets": {"off": off}}))
    on, overlaid = load(path), load(path, "off")
    del content["presets"]
    content["robustness"] |= alone
    path.write_text(yaml.safe_dump(content | {"fabrication": off["fabrication"]}))
    assert load(path) == overlaid
    assert on.robustness is not None
    assert on.robustness.together is not None
    again = from_canonical(canonical_json(overlaid))
    for asked in (overlaid, again):
        assert asked.robustness is not None
        assert asked.robustness.together is None
        assert asked.fabrication.shims.tabs is None
    assert content_hash(again) == content_hash(overlaid) != content_hash(on)


def test_all_that_null_turns_off_is_listed() -> None:
    parts = {"problem": Problem.model_json_schema()}
    parts |= parts["problem"]["$defs"]
    found = {
        key
        for part in parts.values()
        for key, asked in part.get("properties", {}).items()
        if asked.get("default") is not None and {"type": "null"} in asked.get("anyOf", [])
    }
    assert found == {switch[-1] for switch in SWITCHES}


SERIES = "drive:\n  kind: time_series\n  units: centre\n  file: motion.csv\n"


def with_series(fig2: Path, folder: Path, series: str) -> Path:
    text = fig2.read_text(encoding="utf-8").replace(
        "  periods: 2\n  samples", "  duration: 1 s\n  samples"
    )
    head, _, rest = text.partition("drive:\n")
    _, _, tail = rest.partition("horizon:\n")
    path = folder / "problem.yaml"
    path.write_text(f"{head}{series}horizon:\n{tail.partition('sweep:')[0]}", encoding="utf-8")
    return path


def test_a_measured_motion_enters_by_its_content(fig2: Path, tmp_path: Path) -> None:
    path = with_series(fig2, tmp_path, SERIES)
    (tmp_path / "motion.csv").write_text("0,0,0,0\n", encoding="utf-8")
    before = load(path)
    (tmp_path / "motion.csv").write_text("0,0,0,1\n", encoding="utf-8")
    assert content_hash(load(path)) != content_hash(before)
    assert before.drive.case_weights == (1.0,)
    (tmp_path / "motion.csv").unlink()
    with refused("cannot be read"):
        load(path)
    (tmp_path / "motion.csv").write_bytes(b"0")
    wrong = hashlib.sha256(b"1").hexdigest()
    with refused("not the file that was meant", "drive.sha256"):
        load(with_series(fig2, tmp_path, f"{SERIES}  sha256: {wrong}\n"))


def test_a_measured_motion_is_read_in_the_units_of_its_heading(fig2: Path, tmp_path: Path) -> None:
    path = with_series(fig2, tmp_path, SERIES)
    rows = ["time (ms);ux (cm);uy (mm);theta (deg)", "0;0;0;0", "1000;0,5;-2;180"]
    (tmp_path / "motion.csv").write_text("\n".join(rows))
    (drive,) = scene_of(load(path), tmp_path).loads.motions
    np.testing.assert_allclose(drive(np.array([1.0])), [[5.0, -2.0, math.pi]])
    (tmp_path / "motion.csv").write_text("\n".join([*rows, "1500;1;x;0"]))
    with refused("not a finite number") as caught:
        scene_of(load(path), tmp_path)
    assert caught.value.line == 4


FOIL = "foil: { young_modulus: 4500 MPa, thickness: 0.125 mm, width: 8 mm }"
STIFFNESSES = "axial_stiffness: 120 N/mm\n  shear_stiffness: 1.19 N/mm\n"
STIFFNESSES += "  bending_stiffness: 1.5 N mm/rad"


def test_foil_takes_the_place_of_the_stiffnesses(fig2: Path, tmp_path: Path) -> None:
    """E w t / l, 12 E I / l^3, E I / l; what is cut is of the same foil."""
    made = edited(fig2, tmp_path, STIFFNESSES, FOIL)
    inertia = 8.0 * 0.125**3 / 12
    found = scene_of(made, tmp_path).structure.material[1:4]
    wanted = [4500 * 8 * 0.125 / 2.25, 12 * 4500 * inertia / 2.25**3, 4500 * inertia / 2.25]
    np.testing.assert_allclose(np.array(found, dtype=float), wanted)
    assert (made.fabrication.thickness, made.fabrication.shims.thickness) == (8.0, 0.125)
    assert from_canonical(canonical_json(made)) == made


def test_stiffnesses_have_one_form(refusal: Refusal) -> None:
    assert refusal(STIFFNESSES, f"{FOIL}\n  shear_stiffness: 1 N/mm").key == "material"
    missing = refusal("bending_stiffness: 1.5 N mm/rad", "")
    assert missing.key == "material.bending_stiffness"


def test_foil_of_the_model_is_the_one_that_is_cut(fig2: Path, tmp_path: Path) -> None:
    other = fig2.read_text(encoding="utf-8").replace(STIFFNESSES, FOIL)
    cut = "fabrication:\n  shims:\n    thickness: 0.25 mm\n\nconstraints:"
    (tmp_path / "other.yaml").write_text(other.replace("constraints:", cut, 1))
    with refused("material.foil", "fabrication.shims.thickness"):
        load(tmp_path / "other.yaml")


@cases("problem", "made, layers, words")
def test_aspect_ratios_decide_the_cutting(made: dict[str, object], layers: int, words: str) -> None:
    settings = Fabrication.model_validate(made, context=SIM_UNITS)
    assert settings.laser_layers == layers
    assert settings.laser_route.startswith(words)


def test_infill_is_little_where_mass_plays_no_part(fig2: Path) -> None:
    moving = load(fig2)
    assert moving.infill == pytest.approx(6.18e-9 / (1.24e-9 * 8.1))
    assert load(fig2.parents[1] / "fig4/problem.yaml").infill == 0.15


@cases("problem", "section, bound, alike, apart")
def test_designs_depend_on_how_they_are_made_as_far_as_their_limits_do(
    fig2: Path, tmp_path: Path, section: str, bound: str, alike: list[list[str]], apart: list[str]
) -> None:
    def hashed(more: str, made: str) -> str:
        new = f"\nfabrication: {{ {made} }}\n{section}:{more}"
        text = edited(fig2, tmp_path, f"\n{section}:", new)
        return section_hash(text, "design", "sqp")

    for more, pair in zip(("", f"\n  {bound}"), alike, strict=False):
        assert hashed(more, pair[0]) == hashed(more, pair[1])
    assert len({hashed(f"\n  {bound}", each) for each in apart}) == len(apart)
