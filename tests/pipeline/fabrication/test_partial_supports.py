"""Fixtures hold units in every way; what the study leaves free of them is told."""

import json
import logging
from pathlib import Path

import pytest

from pipeline import problem
from pipeline.__main__ import run_stage
from pipeline.fabrication.checks.package_check import page_words
from pipeline.posing import free_dofs, scene_of
from tests.pipeline import unchanged
from tests.pipeline.static import HOLE, write

PLATES = """
  - { units: left, clamp: [ux] }
  - { units: bottom, clamp: [uy, theta] }
"""


def study(folder: Path, *changes: tuple[str, str]) -> Path:
    """5 x 5 units around a hole."""
    path = write(folder, HOLE, size=5, amplitude=1.0)
    text = path.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path


ROLLERS = ("\n  - units: left\n", PLATES)


def test_degrees_of_freedom_that_nothing_takes_are_listed(tmp_path: Path) -> None:
    path = study(tmp_path, ROLLERS, ("duration: 1 s\nhor", "duration: 1 s\n  free: [uy]\nhor"))
    free = free_dofs(scene_of(problem.load(path), tmp_path))
    left, right = {5: ("uy", "theta"), 10: ("uy", "theta")}, {9: ("uy",), 14: ("uy",)}
    # the corners are held by two plates, or by a plate and the drive
    assert {unit: free[unit] for unit in (*left, *right, 1)} == left | right | {1: ("ux",)}
    assert 0 not in free
    assert 4 not in free
    assert free_dofs(scene_of(problem.load(study(tmp_path)), tmp_path)) == {}


def test_a_force_takes_the_way_along_which_it_drives(tmp_path: Path) -> None:
    force = ("kind: linear_ramp", "kind: force"), ("amplitude: 1.0 mm", "amplitude: 1 N")
    path = study(tmp_path, *force, ("  duration: 1 s\nhor", "hor"))
    assert free_dofs(scene_of(problem.load(path), tmp_path)) == {}


def test_a_package_tells_what_its_fixtures_hold_beyond_the_study(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path, out = study(tmp_path, ROLLERS), tmp_path / "fabrication/altered"
    design = unchanged.write(path)
    words = ["--problem", path, "--design", design, "--structure", "altered", "--out-dir", out]
    with caplog.at_level(logging.WARNING):
        assert run_stage("fabricate", [*map(str, words), "--quiet"]) == 0
    told = "ux of B1, C1, D1; uy and theta of A2, A3, A4, A5"
    assert f"the study leaves free {told}" in caplog.text
    manifest = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["free_dofs"]["A2"] == ["uy", "theta"]
    assert f"The study leaves free {told}" in " ".join(page_words(out / "assembly.pdf")[0])
