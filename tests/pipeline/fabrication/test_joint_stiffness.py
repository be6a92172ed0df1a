"""Tells joints simulated stiffer than shims: those of an inclusion, of ligaments in a file."""

import dataclasses
import json
import logging
from pathlib import Path

import numpy as np
import pytest

from pipeline import problem
from pipeline.__main__ import run_stage
from pipeline.fabrication.checks.package_check import page_words
from pipeline.fabrication.papers import read_bill, stiffness_words
from pipeline.posing import stiffness_factors
from tests.pipeline import unchanged
from tests.pipeline.fabrication import handmade
from tests.pipeline.static import HOLE, write

HEART = "inclusion: { region: { disc: { radius: 7 mm } }, stiffness_factor: 150 }\n"


def study(folder: Path) -> Path:
    """5 x 5 units around a stiff one."""
    path = write(folder, HOLE, size=5, amplitude=1.0)
    void = next(line for line in HOLE.splitlines(keepends=True) if line.startswith("void"))
    path.write_text(path.read_text(encoding="utf-8").replace(void, HEART), encoding="utf-8")
    return path


def test_a_package_tells_which_joints_are_to_be_stiffer(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path, out = study(tmp_path), tmp_path / "fabrication/altered"
    design = unchanged.write(path)
    words = ["--problem", path, "--design", design, "--structure", "altered", "--out-dir", out]
    with caplog.at_level(logging.WARNING):
        assert run_stage("fabricate", [*map(str, words), "--quiet"]) == 0
    joints = ("B3 - C3", "C3 - D3", "C2 - C3", "C3 - C4")
    assert "150 times as stiff: " in caplog.text
    sheet = " ".join(page_words(out / "assembly.pdf")[0])
    for joint in joints:
        assert joint in caplog.text
        assert joint in sheet
    notes = [row["note"] for row in read_bill(out / "bom.csv") if row["item"] == "ligament"]
    stiff = {note.partition(";")[0] for note in notes if "150 times as stiff in the study" in note}
    assert stiff == set(joints)
    told = json.loads((out / "manifest.json").read_text(encoding="utf-8"))["stiffness_factors"]
    assert list(told.values()) == [[150.0, 150.0, 150.0]] * 4


def test_an_inclusion_is_stiff_in_the_altered_structures_only(tmp_path: Path) -> None:
    posed = problem.load(study(tmp_path))
    assert np.all(stiffness_factors(posed, "intact") == 1.0)
    assert np.count_nonzero(stiffness_factors(posed, "cloaked") == 150.0) == 3 * 4


def test_joints_are_named_by_their_stiffness() -> None:
    one = handmade.specimen()
    assert stiffness_words(one) == ""
    factors = {0: (2.0, 2.0, 2.0), 1: (1.0, 0.5, 3.0), 2: (2.0, 2.0, 2.0)}
    names = [ligament.name for ligament in one.ligaments]
    assert stiffness_words(dataclasses.replace(one, stiffness=factors)) == (
        f"2 times as stiff: {names[0]}, {names[2]};"
        f" 1 times as stiff along, 0.5 across, 3 in bending: {names[1]}"
    )


def test_many_stiffnesses_are_left_to_the_bill() -> None:
    one = handmade.specimen()
    factors = {each.number: (2.0 + each.number,) * 3 for each in one.ligaments}
    words = stiffness_words(dataclasses.replace(one, stiffness=factors))
    assert words == "7 joints of 7 stiffnesses, in the bill"
