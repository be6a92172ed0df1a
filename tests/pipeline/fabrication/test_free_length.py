"""Shims are free in more than their ligaments, as tips beside slots are cut back: it is told."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.fabrication.papers import read_bill
from pipeline.stages.fabricate import foil_warning
from tests.pipeline.fabrication import built, handmade

FREE = 2.25 + 2 * handmade.TRUNCATION


def test_bill_and_manifest_tell_the_free_length_of_each_shim(tmp_path: Path) -> None:
    built.write(tmp_path / "cloaked")
    rows = read_bill(tmp_path / "cloaked/bom.csv")
    notes = [row["note"] for row in rows if row["item"] == "ligament"]
    told = json.loads((tmp_path / "cloaked/manifest.json").read_text(encoding="utf-8"))["prebend"]
    assert len(told) == len(notes) == 7
    for note, one in zip(notes, told.values(), strict=True):
        assert 2.25 < one["free_mm"] < 5.0
        assert f"; free {one['free_mm']:.2f} mm" in note


def test_foil_that_is_freer_than_it_was_simulated_is_warned_of() -> None:
    one = handmade.specimen()
    long = tuple(replace(ligament, gap=2.25) for ligament in one.ligaments)
    told = foil_warning(replace(one, ligaments=long))
    share = 2.25 / FREE
    assert told is not None
    assert f"{share:.2f} of the axial and bending stiffness" in told
    assert f"{np.power(share, 3):.2f} of the shear stiffness" in told
    snug = tuple(replace(ligament, gap=ligament.free) for ligament in one.ligaments)
    assert foil_warning(replace(one, ligaments=snug)) is None
