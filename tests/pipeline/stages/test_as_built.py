from pathlib import Path

import numpy as np
import pytest

from pipeline import datasets, problem
from pipeline.__main__ import run_stage
from pipeline.fabrication.units import end_angles, network
from pipeline.posing import read_design, scene_of, structures_of
from pipeline.stages.as_built import bent_warning
from pipeline.stages.fabricate import loss_warning
from sim.scene import as_built
from tests.pipeline import static

SHIELD = (
    "cloak: { ring: { inner: 16 mm, outer: 25 mm } }\n"
    "objective: { kind: strain_energy, target: rest, region: { disc: { radius: 16 mm } } }\n"
)
BENT = "fabrication: { slots: { direction: centroid } }\n"


@pytest.mark.slow
def test_losses_are_those_of_the_relaxed_structures(tmp_path: Path) -> None:
    source, told = static.write(tmp_path, SHIELD + BENT, 5, 3.0), tmp_path / "built.nc"
    design = static.designed(source)
    words = ["--problem", str(source), "--quiet", "--design", str(design), "--out"]
    assert run_stage("as_built", [*words, str(told)]) == 0
    asked, built = problem.load(source), datasets.read(told, "response")
    read = read_design(asked, design)
    for name, structure in structures_of(scene_of(asked, tmp_path), read).items():
        angles = end_angles(network(read, name), asked.fabrication, design)
        found = as_built(*structure, angles)
        assert abs(found.loss_as_built / found.loss_as_designed - 1.0) > 1e-5
        loss = float(built["loss"].sel(structure=name).mean())
        assert loss == pytest.approx(found.loss_as_built, rel=1e-6)
    start = built.isel(time=0)
    assert np.allclose(start["displacement"], 0.0, atol=1e-9)
    assert np.allclose(start["roi_energy"], 0.0, atol=1e-12)


@pytest.mark.slow
def test_a_design_with_turned_slots_is_drawn_and_built_as_optimised(tmp_path: Path) -> None:
    source = static.write(tmp_path, SHIELD, 5, 3.0)
    text = source.read_text(encoding="utf-8")
    source.write_text(text.replace("optimiser: {", "optimiser: { as_built: true,"), "utf-8")
    design, told, seen = static.designed(source), tmp_path / "built.nc", tmp_path / "response.nc"
    words = ["--problem", str(source), "--quiet", "--design", str(design), "--out"]
    assert run_stage("as_built", [*words, str(told)]) == 0
    assert run_stage("simulate", [*words, str(seen)]) == 0
    asked, read = problem.load(source), datasets.read(design, "design")
    drawn = end_angles(network(read, "cloaked"), asked.fabrication, design)
    angles = read["end_angles"].values
    assert 1.0 < np.degrees(np.abs(angles).max()) < 30.1
    np.testing.assert_allclose(drawn, angles, atol=1e-6)
    built, simulated = (datasets.read(path, "response")["loss"] for path in (told, seen))
    found = float(read["best_loss"].min())
    for loss in (built, simulated):
        assert float(loss.sel(structure="cloaked").mean()) == pytest.approx(found, rel=1e-5)
    assert found < 0.9 * float(simulated.sel(structure="altered").mean())


def test_shims_bent_beyond_the_law_of_ligaments_are_warned_of() -> None:
    angles = np.radians([[5.0, -29.0], [31.0, 0.0], [-40.0, 103.0]])
    assert bent_warning("cloaked", angles[:1]) == []
    (told,) = bent_warning("cloaked", angles)
    assert "2 of 3 shims of the cloaked structure" in told
    assert "at most by 103°" in told


def test_a_specimen_that_does_worse_than_designed_is_told() -> None:
    for designed, loss in ((0.01, 0.012), (0.0, 1e-4)):
        assert loss_warning({"loss_as_designed": designed, "loss_as_built": loss}) is None
    assert loss_warning({"failure": "no equilibrium found"}) is None
    told = loss_warning({"loss_as_designed": 0.01, "loss_as_built": 0.14})
    assert told is not None
    assert "the loss is 0.14 for 0.01 as designed; ask for optimiser.as_built" in told
