from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.posing.structure_variables import present_ligaments
from sim.core import Floats, SimulationError
from sim.quasistatics import StaticRecord, StaticSolver
from sim.solvers import PrescribedMotion
from sim.structure import ConcreteParameters
from tests.pipeline.conftest import Failing

CLOSED = 12  # the unit that the void removes


def words(hole: list[str], out: Path) -> list[str]:
    return [*hole, str(out), "--design", str(Path(hole[1]).with_name("design.nc"))]


def test_from_problem_to_response(hole: list[str], tmp_path: Path) -> None:
    assert run_stage("simulate", words(hole, tmp_path / "r.nc")) == 0
    chosen, response = Path(hole[1]).with_name("design.nc"), tmp_path / "r.nc"
    shipped, moved = datasets.read(chosen, "design"), datasets.read(response, "response")
    void = shipped["region"].values == 3
    assert np.flatnonzero(void).tolist() == [CLOSED]
    np.testing.assert_array_equal(np.isnan(shipped["vertices"].values).all(axis=(1, 2)), void)
    assert not np.isnan(shipped["vertices_initial"]).any()
    assert np.count_nonzero(~present_ligaments(shipped)) == 4
    assert present_ligaments(shipped, "intact").all()

    assert moved["structure"].values.tolist() == ["intact", "altered", "cloaked"]
    gone = np.isnan(moved["displacement"].values).all(axis=(1, 2, 4))
    np.testing.assert_array_equal(gone, [np.zeros(25, bool), void, void])
    intact, altered, cloaked = moved["loss"].values[:, 0]
    assert intact == 0.0
    assert cloaked < 0.9 * altered
    assert cloaked == pytest.approx(float(shipped["best_loss"][0]), rel=1e-9)
    assert (moved["stability"] == 1).all()
    push = moved["drive_displacement"].sel(xy="x").values[0]
    np.testing.assert_allclose(push, -3.0 * moved["time"])
    work = np.trapezoid(moved["drive_force"].sel(xy="x").values, push, axis=-1)
    energy = (moved["strain_energy"] + moved["contact_energy"]).values[..., -1]
    np.testing.assert_allclose(work, energy, rtol=0.02)


def test_a_design_is_known_whatever_its_file_is_called(hole: list[str], tmp_path: Path) -> None:
    made = Path(hole[1]).with_name("design_sqp.nc")
    renamed = tmp_path / "mine.nc"
    renamed.write_bytes(made.read_bytes())
    assert run_stage("select", [*hole, str(tmp_path / "d.nc"), "--designs", str(renamed)]) == 0
    assert datasets.read(tmp_path / "d.nc", "design").attrs["shipped_method"] == "sqp"


@pytest.fixture
def stopping(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Lets static solvers find no equilibrium of structures with the void beyond some load."""
    whole = StaticSolver.forward

    def until(load: float) -> None:
        def forward(
            solver: StaticSolver, values: ConcreteParameters, drive: PrescribedMotion
        ) -> tuple[Floats, Floats, StaticRecord]:
            beyond = np.flatnonzero(solver.output_times > load * (1 + 1e-9))
            if solver.topology.n_units == 24 and len(beyond):
                raise SimulationError("no equilibrium found", step=int(beyond[0]), unit=12)
            return whole(solver, values, drive)

        monkeypatch.setattr(StaticSolver, "forward", forward)

    return until


def test_a_path_that_ends_early_is_kept_so_far(
    hole: list[str], tmp_path: Path, stopping: Callable[[float], None], failing: Failing
) -> None:
    partial = tmp_path / "r_partial.nc"
    stopping(0.8)
    told = failing("simulate", words(hole, tmp_path / "r.nc"))
    assert "the altered structure cannot be simulated beyond a driven displacement of 2.25" in told
    assert "(75% of the load path), look at unit [3, 2]: no equilibrium found" in told
    assert f"all up to there is in {partial}" in told
    kept = datasets.read(partial, "response")
    assert kept["structure"].values.tolist() == ["intact", "altered", "cloaked"]
    assert float(kept["time"][-1]) == pytest.approx(0.75)
    assert float(kept["drive_displacement"].sel(xy="x")[0, -1]) == pytest.approx(-2.25)


def test_nothing_is_kept_of_a_path_that_ends_at_once(
    hole: list[str], tmp_path: Path, stopping: Callable[[float], None], failing: Failing
) -> None:
    stopping(0.1)
    (tmp_path / "r_partial.nc").write_text("of a run before this one")
    assert "look at unit [3, 2]" in failing("simulate", words(hole, tmp_path / "r.nc"))
    told = failing("design", [*hole, str(tmp_path / "d.nc"), "--method", "sqp"])
    assert "the initial structure cannot be simulated" in told
    assert "drive.amplitude" in told
    assert not list(tmp_path.glob("*.nc"))
