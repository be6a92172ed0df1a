"""Tests that what is found from a rendered or computed track is told as synthetic."""

from pathlib import Path

import numpy as np
import pytest

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.calibration import calibration_dataset
from pipeline.calibration.inputs import Population, has_synthetic
from pipeline.problem.reading import load_section
from pipeline.runtime import ROOT
from pipeline.stages import calibrate, validate
from tests.pipeline.calibration.specimens import LATTICE, described, written
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
