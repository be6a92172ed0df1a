from pathlib import Path

import numpy as np
import pytest

from pipeline.posing import failures, limits_of, scene_of
from pipeline.posing.to_scene import contact_laws
from pipeline.problem.reading import load
from sim.constraints import ConstraintVector
from sim.optimise import InfeasibleStartError, UnconfirmedError
from sim.structure import VoidAngleContact
from tests.pipeline.conftest import Failing
from tests.pipeline.static import HOLE, SHIELD, write
from tests.tables import cases, refused

SERIES = "{ kind: time_series, units: right, file: push.csv }"


def with_drive(folder: Path, drive: str) -> Path:
    path = write(folder, SHIELD, amplitude=9)
    text = path.read_text(encoding="utf-8")
    ramp = text[text.index("drive:") : text.index("horizon:")]
    path.write_text(text.replace(ramp, f"drive: {drive}\n"), encoding="utf-8")
    return path


def test_the_law_of_contact_is_that_of_the_problem(fig2: Path) -> None:
    laws = contact_laws(load(fig2))
    assert laws["angle"] == VoidAngleContact(np.deg2rad(-15.0), np.deg2rad(-10.0))
    assert scene_of(load(fig2), fig2.parent).structure.contact == laws["angle"]


def design(path: Path, failing: Failing) -> str:
    out = str(path.with_name("design.nc"))
    return failing("design", ["--problem", str(path), "--method", "sqp", "--out", out])


@cases("posing", "old, new, key")
def test_file_key_and_remedy_are_told(
    old: str, new: str, key: str, tmp_path: Path, failing: Failing
) -> None:
    path = write(tmp_path, SHIELD, amplitude=9)
    text = path.read_text(encoding="utf-8").replace("amplitude: 9.0 mm", "amplitude: 9 mm")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    told = design(path, failing)
    assert f"file:   {path}\n" in told
    assert f"key:    {key}" in told


@pytest.mark.parametrize("drive", ["[1, 2]", "3", "[]"])
def test_a_drive_that_is_no_section_is_told_in_words(drive: str, tmp_path: Path) -> None:
    path = with_drive(tmp_path, drive)
    with refused("keys and values are wanted here", "drive"):
        load(path)


@cases("posing", "rows, what")
def test_a_measured_drive_that_cannot_be_meant(
    rows: str, what: str, tmp_path: Path, failing: Failing
) -> None:
    path = with_drive(tmp_path, SERIES)
    path.write_text(path.read_text(encoding="utf-8").replace(", steps: 4", ", samples: 5"))
    series = "".join(f"{row},0,0\n" for row in rows.splitlines())
    (tmp_path / "push.csv").write_text(f"time (s),ux (mm),uy (mm),theta (rad)\n{series}")
    assert what in design(path, failing)


@pytest.mark.parametrize(("snap", "elsewhere"), [("allow", False), ("avoid", True)])
def test_an_unconfirmed_run_is_told_what_to_change(
    snap: str, elsewhere: bool, tmp_path: Path
) -> None:
    path = write(tmp_path, HOLE, size=5)
    problem = load(path)
    asked = problem.model_copy(
        update={"objective": problem.objective.model_copy(update={"snap": snap})}
    )
    told = failures.unconfirmed(UnconfirmedError("it snaps"), asked, path)
    assert (told.key, told.what) == ("horizon.steps", "it snaps")
    assert ("optimiser.start" in str(told.remedy)) == elsewhere


def test_an_infeasible_start_names_unit_and_vertex(tmp_path: Path) -> None:
    """And an edge by its ends."""
    path = write(tmp_path, HOLE, size=5)
    scene = scene_of(problem := load(path), tmp_path)
    constraints = ConstraintVector(scene.space, limits_of(problem))
    values = constraints.values(np.zeros(scene.space.n_variables))
    for number in (0, len(values) - 1):
        error = InfeasibleStartError(number, 0.5)
        told = failures.infeasible_start(error, constraints, path)
        kind, where = constraints.named(number)
        assert told.key == f"constraints.{'convex' if kind == 'convexity' else kind}"
        assert where in told.what
        assert where.startswith("vertex ")
        assert " of unit [" in where
    longer = np.zeros(scene.space.n_variables)
    longer[:2] = 4.0
    changed = np.flatnonzero(constraints.values(longer) != constraints.values(0 * longer))
    vertex = np.flatnonzero(scene.lattice.group == scene.space.groups[0])[0]
    i, j = scene.lattice.index[scene.lattice.unit[vertex]]
    assert f"of unit [{i}, {j}]" in constraints.named(int(changed[0]))[1]
