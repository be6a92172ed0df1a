"""Small calibrations whose data are computed, for the quick tests and for the trials of seeds."""

import json
from pathlib import Path
from typing import Any

import yaml

from pipeline.__main__ import run_stage
from pipeline.calibration.inputs import Calibration
from pipeline.problem.reading import load_section

TRUTH, START, LATTICE, ENDS = yaml.safe_load_all("""
{ density: 6.18 kg/m^2, axial_stiffness: 120 N/mm, shear_stiffness: 1.19 N/mm,
  bending_stiffness: 1.5 N mm/rad, damping: { ratio: 0.0186 } }
--- # of a fit
{ density: 6.18 kg/m^2, axial_stiffness: 100 N/mm, shear_stiffness: 1.0 N/mm,
  bending_stiffness: 1.8 N mm/rad, damping: { ratio: 0.015 } }
---
{ columns: 3, rows: 4, spacing: 15 mm, ligament_length: 2.25 mm, bias_angle: -20 deg }
---
{ tension: 1.05 mm, compression: 3.0 mm, shear: 3.0 mm }
""")
STIFFNESS = ["axial_stiffness", "shear_stiffness", "bending_stiffness"]


def force_sets(noise: str = "0.02 N", points: int = 16) -> list[dict[str, Any]]:
    """Tension, compression and shear of a small lattice."""
    virtual = {"points": points, "noise": noise}
    kind = {"kind": "force_displacement", "lattice": LATTICE}
    return [
        {**kind, "name": test, "test": test, "virtual": {"end": end, **virtual}}
        for test, end in ENDS.items()
    ]


def decay_set(noise: str = "0.2 deg") -> dict[str, Any]:
    """Two units on one ligament, let go."""
    virtual = {"amplitude": "8 deg", "duration": "0.25 s", "noise": noise}
    return {"kind": "free_decay", "name": "decay", "virtual": virtual}


def described(data: list[dict[str, Any]], fit: list[str], **changed: Any) -> dict[str, Any]:  # noqa: ANN401
    """The YAML of a calibration of such sets."""
    return {
        "spacing": "15 mm",
        "material": START,
        "fit": fit,
        "data": data,
        "virtual": {"truth": TRUTH, "seed": 1},
        **changed,
    }


def written(folder: Path, described: dict[str, Any]) -> Path:
    """The YAML on disk; what is JSON is YAML."""
    path = folder / "calibration.yaml"
    path.write_text(json.dumps(described), encoding="utf-8")
    return path


def loaded(folder: Path, described: dict[str, Any]) -> Calibration:
    return load_section(written(folder, described), Calibration)


def synthesised(folder: Path, text: dict[str, object]) -> Path:
    source = written(folder, text)
    done = ["synthesise", str(source), "--out-dir", str(folder / "data"), "--quiet"]
    assert run_stage("calibrate", done) == 0
    return folder / "data/calibration.yaml"
