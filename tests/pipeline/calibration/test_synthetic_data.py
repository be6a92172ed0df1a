"""Tests that what is found from rendered or computed data is told as synthetic."""

from pathlib import Path

import numpy as np
import pytest

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.calibration import calibration_dataset
from pipeline.calibration.inputs import (
    Calibration,
    KnownPictures,
    LoadCycles,
    Population,
    has_synthetic,
)
from pipeline.problem.reading import load_section
from pipeline.runtime import ROOT
from pipeline.stages import calibrate, validate
from tests.pipeline.calibration.specimens import (
    LATTICE,
    described,
    force_sets,
    synthesised,
    written,
)
from tests.pipeline.samples import sample

PROBLEM = str(ROOT / "experiments/calibration/specimens/squeezed.yaml")
FORCES = {"kind": "force_displacement", "lattice": LATTICE, "test": "compression"}
MOTION = {"kind": "track", "problem": PROBLEM, "structure": "altered"}
HINGES = ROOT / "experiments/validation/hinges.yaml"


def track(folder: Path, synthetic: str) -> None:
    origin = dict.fromkeys(("parents", "packages", "history", "git_commit"), "{}")
    told = origin | {"recording": "{}", "synthetic": synthetic}
    datasets.write(sample("track"), folder / "run.nc", "track", told)


@pytest.mark.parametrize("asked", [FORCES, MOTION], ids=lambda each: each["kind"])
@pytest.mark.parametrize("synthetic", ["yes", "no"])
def test_constants_of_a_track_are_told_as_it_is(
    asked: dict[str, object], synthetic: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    track(tmp_path, synthetic)
    path = written(
        tmp_path,
        described([asked | {"name": "run", "file": "run.nc"}], ["shear_stiffness"], virtual=None),
    )

    def fragment(*_: object, synthetic: bool) -> str:
        return f"# {synthetic}\n"

    monkeypatch.setattr(calibrate, "fit_calibration", lambda *_: None)
    made = sample("calibration"), None
    monkeypatch.setattr(calibration_dataset, "assemble_calibration", lambda *_: made)
    monkeypatch.setattr(calibration_dataset, "material_fragment", fragment)
    out = tmp_path / "found.nc"
    assert run_stage("calibrate", [str(path), "--out", str(out), "--quiet"]) == 0
    assert datasets.read(out, "calibration").attrs["synthetic"] == synthetic
    assert out.with_suffix(".yaml").read_text() == f"# {synthetic == 'yes'}\n"


def test_constants_drawn_from_a_synthetic_track_say_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    track(tmp_path, "yes")
    asked = load_section(HINGES, Population)
    filmed = asked.data[0].model_copy(update={"file": str(tmp_path / "run.nc")})
    assert has_synthetic((filmed,), HINGES.parent)
    assert not has_synthetic(asked.data, HINGES.parent)
    changed = asked.model_copy(update={"data": (filmed, *asked.data[1:])})
    monkeypatch.setattr(validate, "load_section", lambda *_: changed)
    monkeypatch.setattr(validate, "draw_constants", lambda *_: np.ones((2, 3)))
    out = tmp_path / "constants.csv"
    assert run_stage("validate", ["constants", str(HINGES), "--out", str(out), "--quiet"]) == 0
    assert out.read_text().startswith("# SYNTHETIC: found from computed data")


def test_computed_curves_are_told_without_their_calibration(tmp_path: Path) -> None:
    path = synthesised(tmp_path, described(force_sets(points=3)[2:], ["shear_stiffness"]))
    asked = load_section(path, Calibration)
    assert has_synthetic(asked.data, path.parent)
    table = path.parent / "shear.csv"
    one = load_section(HINGES, Population).data[0].model_copy(update={"file": str(table)})
    assert has_synthetic((one,), HINGES.parent)
    table.write_text(table.read_text().partition("\n")[2])
    assert not has_synthetic((one,), HINGES.parent)


def test_cycles_of_computed_records_say_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = load_section(HINGES.parent / "morpher.yaml", LoadCycles)
    assert not has_synthetic(asked.records, HINGES.parent)
    (tmp_path / "one.csv").write_text("# SYNTHETIC: computed\napproach (mm),tension (N)\n0,0\n")
    record = asked.records[2].model_copy(update={"file": str(tmp_path / "one.csv")})
    changed = asked.model_copy(update={"records": (record,)})
    monkeypatch.setattr(validate, "load_section", lambda *_: changed)
    monkeypatch.setattr(validate, "study_cycles", lambda *_: sample("load_cycles"))
    out = tmp_path / "cycles.nc"
    words = ["cycles", str(HINGES.parent / "morpher.yaml"), "--out", str(out), "--quiet"]
    assert run_stage("validate", words) == 0
    assert datasets.read_attributes(out)["synthetic"] == "yes"


def test_rendered_pictures_are_told_as_such(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, out = HINGES.parent / "pictures.yaml", tmp_path / "pictures.nc"
    asked = load_section(path, KnownPictures).model_copy(update={"synthetic": True})
    monkeypatch.setattr(validate, "load_section", lambda *_: asked)
    monkeypatch.setattr(validate, "study_pictures", lambda *_: sample("pictures"))
    assert run_stage("validate", ["pictures", str(path), "--out", str(out), "--quiet"]) == 0
    assert datasets.read_attributes(out)["synthetic"] == "yes"
