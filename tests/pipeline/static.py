"""Text of static problems: the authors' scenes, and small ones that are quick to solve."""

from copy import deepcopy
from pathlib import Path

import yaml

from pipeline.__main__ import run_stage

GEOMETRIC = 3
"""Evaluations of a second optimisation, with contact on distance."""

_TEXT = """
lattice:
  kind: quads
  columns: {size}
  rows: {size}
  spacing: 15 mm
  ligament_length: 2.25 mm
  bias_angle: 20 deg
material:
  density: 6.18 kg/m^2
  axial_stiffness: 120 N/mm
  shear_stiffness: 1.19 N/mm
  bending_stiffness: 1.5 N mm/rad
  damping: {{ ratio: 0.0186 }}
contact: {{ law: angle, stiffness: 1.5 N mm/rad^2, barrier_angle: -15 deg, cutoff_angle: -10 deg }}
supports:
  - units: left
drive:
  kind: linear_ramp
  units: right
  amplitude: {amplitude} mm
  directions: [180 deg]
  duration: 1 s
horizon: {{ duration: 1 s, steps: 4 }}
constraints: {{ edge_length: 3 mm, block_angle: 30 deg, void_angle: 0 deg }}
optimiser: {{ methods: {{ sqp: {{ evaluations: 4 }} }}, geometric: {{ evaluations: {again} }} }}
response: {{ samples: 9 }}
{more}
"""

MIMIC = "objective: { kind: displacement, target: intact }\n"

SMILE = (
    "void: { curve: { kind: smile, centre: [105 mm, 97.5 mm], inner_radius: 45 mm,"
    " inner_rise: 30 mm, outer_radius: 60 mm, outer_rise: 15 mm } }\n"
    "cloak: { disc: { centre: [105 mm, 97.5 mm], radius: 73.5 mm } }\n" + MIMIC
)
HEART = (
    "void: { curve: { kind: heart, size: [270 mm, 198 mm], centre: [225 mm, 221.25 mm] } }\n"
    "cloak: { disc: { centre: [225 mm, 221.25 mm], radius: 154 mm } }\n" + MIMIC
)
RIGID_HEART = (
    "inclusion: { region: { curve: { kind: heart, size: [105 mm, 90 mm],"
    " centre: [112.5 mm, 105 mm], points: 30 } } }\n"
    "cloak: { disc: { centre: [112.5 mm, 105 mm], radius: 77 mm } }\n" + MIMIC
)
SHIELD = (
    "cloak: { disc: { radius: 91 mm } }\n"
    "objective: { kind: strain_energy, target: rest, region: { disc: { radius: 67.5 mm } } }\n"
)
HOLE = "void: { disc: { radius: 7 mm } }\ncloak: { disc: { radius: 22 mm } }\n" + MIMIC


def as_draft(problem: Path, evaluations: int) -> None:
    """Makes a problem the preset `quick` of one that designs with more evaluations."""
    content = yaml.safe_load(problem.read_text())
    content["presets"] = {"quick": {"optimiser": deepcopy(content["optimiser"])}}
    content["optimiser"]["methods"]["sqp"]["evaluations"] = evaluations
    problem.write_text(yaml.safe_dump(content))


def designed(problem: Path, *more: str) -> Path:
    """Designs by SQP and selects, beside the problem; returns the file of the design."""
    words = ["--problem", str(problem), *more, "--quiet", "--out"]
    made, chosen = (problem.with_name(f"{name}.nc") for name in ("design_sqp", "design"))
    assert run_stage("design", [*words, str(made), "--method", "sqp"]) == 0
    assert run_stage("select", [*words, str(chosen), "--designs", str(made)]) == 0
    return chosen


def write(folder: Path, more: str, size: int = 15, amplitude: float = 15.0) -> Path:
    """Writes a static problem of `size` x `size` units into `folder`."""
    path = folder / "problem.yaml"
    text = _TEXT.format(size=size, amplitude=amplitude, again=GEOMETRIC, more=more)
    path.write_text(text, encoding="utf-8")
    return path
