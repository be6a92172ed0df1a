import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.problem.fields import csv_columns, units
from pipeline.runtime import ROOT
from tests.pipeline.calibration import specimens
from tests.tables import cases

SPECIMENS = ROOT / "experiments/calibration/specimens"
ERROR = {"displacement": "0.005 mm", "rotation": "0.02 deg"}
FAST = {"rate": "60 Hz", "noise": ERROR, "load": "0.01 N"}
CONTACT = {
    "law": "angle",
    "stiffness": "1.5 N mm/rad^2",
    "barrier_angle": "-15 deg",
    "cutoff_angle": "5 deg",
}

START = specimens.TRUTH | {"shear_stiffness": "1.1 N/mm", "bending_stiffness": "1.6 N mm/rad"}
Output = pytest.CaptureFixture[str]
READINGS = {"displacement": units.LENGTH, "force": units.FORCE}
WANTED = ["shear_stiffness", "bending_stiffness"]


def found_from(path: Path, folder: Path) -> xr.Dataset:
    out = folder / "found.nc"
    assert run_stage("calibrate", [str(path), "--out", str(out), "--quiet"]) == 0
    return datasets.read(out, "calibration").set_index(parameter="parameter")


def assert_inside(found: xr.Dataset, true: dict[str, float]) -> None:
    for name, value in true.items():
        one = found.sel(parameter=name)
        assert one["lower"] < value < one["upper"], name


@pytest.mark.slow
def test_the_zero_of_a_load_cell_is_found(tmp_path: Path) -> None:
    sets = [each | {"tare": True} for each in specimens.force_sets()[1:]]
    path = specimens.synthesised(tmp_path, specimens.described(sets, WANTED, material=START))
    for each in sets:
        file = tmp_path / f"data/{each['name']}.csv"
        along, force = csv_columns.read_quantities(file, READINGS).T
        lines = [f"{x},{y + 0.7}" for x, y in zip(along, force, strict=True)]
        file.write_text("\n".join(["displacement (mm),force (N)", *lines]))
    found = found_from(path, tmp_path)
    assert_inside(found, {"shear_stiffness": 1.19, "bending_stiffness": 1.5})
    assert (found["standard_error"] < 0.1).all()


def test_the_cutoff_of_contact_is_found(tmp_path: Path) -> None:
    deep = specimens.force_sets(points=24)[1]
    deep["virtual"]["end"] = "6.5 mm"
    asked = specimens.described(
        [deep],
        ["bending_stiffness", "contact_cutoff"],
        material=specimens.TRUTH | {"bending_stiffness": "1.8 N mm/rad"},
        contact=CONTACT,
        virtual={"truth": specimens.TRUTH, "cutoff_angle": "12 deg", "seed": 1},
    )
    found = found_from(specimens.synthesised(tmp_path, asked), tmp_path)
    assert_inside(found, {"bending_stiffness": 1.5, "contact_cutoff": np.deg2rad(12)})
    assert (found["status"] == 0).all()


def track(**changed: Any) -> dict[str, Any]:  # noqa: ANN401
    """A squeezed specimen with a load cell."""
    virtual = {"rate": "6 Hz", "noise": ERROR, "load": "0.01 N"}
    return {
        "kind": "track",
        "name": "motion",
        "problem": "squeezed.yaml",
        "structure": "altered",
        "virtual": virtual,
        "load": {"noise": "0.01 N", "tare": True},
        **changed,
    }


@cases("calibration", "problem, changed, told")
def test_loads_that_are_refused(
    problem: str, changed: dict[str, Any], told: str, tmp_path: Path, capsys: Output
) -> None:
    shutil.copy(SPECIMENS / problem, tmp_path)
    asked = specimens.described([track(problem=problem, **changed)], WANTED, material=START)
    path, folder = specimens.written(tmp_path, asked), tmp_path / "data"
    failed = run_stage("calibrate", ["synthesise", str(path), "--out-dir", str(folder), "--quiet"])
    if not failed:
        path = folder / "calibration.yaml"
        failed = run_stage("calibrate", [str(path), "--out", str(tmp_path / "found.nc"), "--quiet"])
    assert failed == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / "found.nc").exists()


def test_a_cell_in_a_motion_in_time_is_not_computed(tmp_path: Path, capsys: Output) -> None:
    """Refuses a force that would lack the inertia of the grips."""
    shutil.copy(SPECIMENS / "shaken.yaml", tmp_path)
    each = track(problem="shaken.yaml", virtual=FAST, load=None)
    path = specimens.written(tmp_path, specimens.described([each], WANTED, material=START))
    words = ["synthesise", str(path), "--out-dir", str(tmp_path / "data"), "--quiet"]
    assert run_stage("calibrate", words) == 2
    assert "the inertia of the grips" in capsys.readouterr().err
