"""Fits tracks of a listed network, some of whose ligaments have stiffnesses of their own."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from pipeline.calibration.computed_track import simulate_track
from pipeline.calibration.experiments import full_field, pose_specimen
from pipeline.calibration.inputs import Constants, TrackedMotion
from pipeline.posing import scene_of
from pipeline.problem.outlines.network_files import COLUMNS, STIFFNESS_COLUMNS
from pipeline.problem.reading import load
from pipeline.runtime import ROOT
from sim.scene import simulate
from sim.structure import quads

SQUEEZED = ROOT / "experiments/calibration/specimens/squeezed.yaml"
ERROR = {"displacement": "0.001 mm", "rotation": "0.001 deg"}
OWN = ["", "3.57", "3.0"]
"""Axial, shear and bending stiffness of every other ligament: as of all, threefold, twofold."""


@pytest.fixture
def asked(tmp_path: Path) -> TrackedMotion:
    """Lists the squeezed specimen in a file."""
    lattice = quads(4, 4, 15.0, 2.25, np.deg2rad(20.0))
    rows = [",".join((*COLUMNS, *STIFFNESS_COLUMNS))]
    corners = zip(lattice.unit, lattice.vertices.tolist(), strict=True)
    rows += [f"unit,{unit},{x!r},{y!r},,," for unit, (x, y) in corners]
    for number, ends in enumerate(lattice.vertices[lattice.ligaments].tolist()):
        own = ",".join(OWN if number % 2 else ["", "", ""])
        rows += [f"ligament,{number},{x!r},{y!r},{own}" for x, y in ends]
    (tmp_path / "units.csv").write_text("\n".join(rows), encoding="utf-8")
    text = yaml.safe_load(SQUEEZED.read_text(encoding="utf-8"))
    text["lattice"] = {"kind": "file", "file": "units.csv", "spacing": "15 mm"}
    (tmp_path / "problem.yaml").write_text(yaml.safe_dump(text), encoding="utf-8")
    return TrackedMotion.model_validate(
        {
            "kind": "track",
            "name": "motion",
            "problem": "problem.yaml",
            "structure": "altered",
            "virtual": {"rate": "4 Hz", "noise": ERROR},
        }
    )


def test_every_stiffness_has_its_own_factor(asked: TrackedMotion, tmp_path: Path) -> None:
    """Computes and predicts the motion that the study itself has at its nominal constants."""
    made = pose_specimen(asked, tmp_path)
    assert made.stiffness_factors[:2] == pytest.approx(np.array([[1.0, 1.0, 1.0], [1.0, 3.0, 2.0]]))
    problem = load(tmp_path / "problem.yaml")
    scene, nominal = scene_of(problem, tmp_path), Constants(problem.material, None, 15.0)
    track = simulate_track(asked, tmp_path, nominal, np.random.default_rng(0))
    own = simulate(scene, vertices=scene.lattice.vertices, times=track["time"].values)
    computed = track["displacement"].transpose("time", "unit", "dof").values
    np.testing.assert_allclose(computed, own.displacement[0], atol=0.01)
    fitted = full_field.pose_track(asked, tmp_path, nominal, track)
    predicted = fitted.predict(nominal, np.zeros(0))
    np.testing.assert_allclose(predicted, fitted.measured.values, atol=0.02)
