"""Calibrations: a YAML in experiments/calibration is all that it takes."""

from tests.workflow.conftest import Sandbox

FOLDER = "experiments/calibration"
MEASURED = """\
spacing: 15 mm
material:
  density: 6.18 kg/m^2
  axial_stiffness: 120 N/mm
  shear_stiffness: 1.2 N/mm
  bending_stiffness: 1.5 N mm/rad
  damping: {ratio: 0.02}
fit: [damping_ratio]
data: [{kind: free_decay, name: decay, file: decay.csv}]
"""


def test_only_what_is_virtual_is_computed_first(sandbox: Sandbox) -> None:
    folder = sandbox.root / FOLDER
    virtual = len(list(folder.glob("*.yaml")))
    (folder / "mine.yaml").write_text(MEASURED)
    (folder / "decay.csv").write_text("time (s),angle (deg)\n")
    planned = sandbox.planned("calibrate")
    assert planned["calibrate_synthesise"] == virtual > 0
    assert planned["calibrate_fit"] == planned["calibration_figure"] == virtual + 1
