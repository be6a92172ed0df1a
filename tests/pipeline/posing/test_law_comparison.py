from pathlib import Path

import numpy as np
import pytest

from pipeline import problem
from pipeline.posing import scene_of
from pipeline.posing.case_result import PosedStructure
from pipeline.stages.simulate import response_dataset
from tests.pipeline import static


@pytest.mark.parametrize("law", ["angle", "geometric"])
def test_under_its_own_law_a_structure_is_as_it_is_reported(tmp_path: Path, law: str) -> None:
    """Though the loss is that of fewer loads than are shown, between which it may snap."""
    path = static.write(tmp_path, static.HOLE, size=5, amplitude=12.0)
    path.write_text(path.read_text().replace("law: angle", f"law: {law}"))
    asked = problem.load(path)
    scene = scene_of(asked, tmp_path)
    intact = scene.objective.reference
    assert intact is not None
    structures = {
        "intact": PosedStructure(intact.updated(reference=intact), intact.lattice.vertices),
        "altered": PosedStructure(scene, scene.lattice.vertices),
    }
    response = response_dataset(asked, structures, 1)[0].sel(structure="altered").squeeze()
    assert np.isfinite(response["snap_load"]).any() == (law == "geometric")
    own = response.sel(contact_law=law)
    assert own["loss_by_contact"] == response["loss"] > 0.0
    assert own["snaps_by_contact"] == np.isfinite(response["snap_load"]).sum()
    assert own["overlaps_by_contact"] == response["overlapping"].max()
    assert own["gap_by_contact"] == response["gap"].min()
    assert len(np.unique(response["loss_by_contact"])) == 2
