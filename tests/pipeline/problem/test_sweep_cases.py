"""A setting means the same over a problem file as over the problem's canonical form."""

import json
from pathlib import Path

import pytest
import yaml

from pipeline.posing import setting_losses
from pipeline.problem import Problem, canonical_json, content_hash, from_canonical
from pipeline.problem.reading import load
from pipeline.problem.sections import SettingError, apply_setting
from tests.pipeline import static
from tests.tables import refused

RAMP = """drive:
  kind: linear_ramp
  units: right
  amplitude: 2.0 mm
  directions: [180 deg]
  duration: 1 s
"""
PUSH = "{ kind: force, units: right, amplitude: 0.5 N, direction: 180 deg, free: [uy] }"
TURN = "{ kind: rotation, units: { units: [[2, 0]] }, amplitude: 10 deg }"
ONE = RAMP.replace("directions: [180 deg]", "direction: 180 deg")
SEVERAL = f"drives:\n  - {PUSH}\n  - {TURN}\n"


def study(folder: Path, drive: str, more: str = "") -> Path:
    path = static.write(folder, static.HOLE + more, size=5, amplitude=2.0)
    text = path.read_text(encoding="utf-8")
    assert RAMP in text
    path.write_text(text.replace(RAMP, drive), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("drive", "key", "value"),
    [
        (RAMP, "drive.directions", "135 deg"),
        (RAMP, "drive.direction", "135 deg"),
        (ONE, "drive.direction", "135 deg"),
        (ONE, "drive.directions", "135 deg"),
        (SEVERAL, "drives.0.amplitude", "0.2 N"),
        (SEVERAL, "drives.0.direction", "0 deg"),
        (RAMP, "fabrication.slots.direction", "bisector"),
    ],
)
def test_a_setting_is_the_same_over_both_forms(
    drive: str, key: str, value: str, tmp_path: Path
) -> None:
    path = study(tmp_path, drive)
    canonical = json.loads(canonical_json(load(path)))
    found = from_canonical(apply_setting(canonical, {key: value}))
    raw = apply_setting(yaml.safe_load(path.read_text(encoding="utf-8")), {key: value})
    assert content_hash(found) == content_hash(Problem.model_validate(raw))
    assert content_hash(found) != content_hash(load(path))


@pytest.mark.parametrize(
    ("drive", "key", "told"),
    [
        (RAMP, "material.density.x", "'density' holds a value"),
        (SEVERAL, "drives.amplitude", "'drives' holds a list"),
        (SEVERAL, "drives.2.amplitude", "'2' is no item of a list of 2"),
    ],
)
@pytest.mark.parametrize(
    "form", ["sweep: {{ grid: {{ {}: [1 N] }} }}\n", "designs: {{ {}: [1 N] }}\n"]
)
def test_a_key_that_leads_nowhere_is_refused(
    form: str, drive: str, key: str, told: str, tmp_path: Path
) -> None:
    path = study(tmp_path, drive, form.format(key))
    with refused(told, remedy="joined by dots"):
        load(path, "1" if form.startswith("designs") else None)
    with pytest.raises(SettingError, match=told):
        apply_setting(yaml.safe_load(path.read_text(encoding="utf-8")), {key: "1 N"})


@pytest.mark.parametrize("limited", [False, True])
def test_a_foil_may_be_swept(limited: bool, tmp_path: Path) -> None:
    """Shims are cut of the foil that each setting gives."""
    foil = "foil: { young_modulus: 4500 MPa, thickness: 0.125 mm, width: 8 mm }"
    path = study(tmp_path, RAMP)
    text = path.read_text(encoding="utf-8")
    stiff = text[text.index("axial_stiffness") : text.index("  damping")]
    text = text.replace(stiff, f"{foil}\n")
    if limited:
        text = text.replace("void_angle: 0 deg }", "void_angle: 0 deg, shim_strain: 0.1 }")
    path.write_text(text, encoding="utf-8")
    made = setting_losses.posed(load(path), {"material.foil.thickness": "0.25 mm"})
    assert made.shim_thickness == 0.25
    assert made.material.bending_stiffness == pytest.approx(
        8 * load(path).material.bending_stiffness
    )
