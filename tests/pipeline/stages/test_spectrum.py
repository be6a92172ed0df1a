from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import datasets
from pipeline.__main__ import run_stage
from reports.__main__ import main
from tests.pipeline.conftest import Failing
from tests.pipeline.static import HOLE, as_draft, write

ASKED = """
spectrum:
  modes: {modes}
  transmission: {{ from: 1 Hz, to: 101 Hz, points: 3 }}
  compressions: [0, {compression}]
  waves: 3
"""


@pytest.fixture(scope="module")
def design(hole: list[str]) -> Path:
    return Path(hole[1]).with_name("design.nc")


def options(folder: Path, modes: int = 4, compression: float = 0.02) -> list[str]:
    folder.mkdir(exist_ok=True)
    asked = ASKED.format(modes=modes, compression=compression)
    path = write(folder, HOLE + asked, size=5, amplitude=3.0)
    return ["--problem", str(path), "--quiet"]


@pytest.fixture(scope="module")
def analysed(design: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("spectrum")
    out = folder / "spectrum.nc"
    words = [*options(folder), "--design", str(design), "--out", str(out)]
    assert run_stage("spectrum", words) == 0
    return out


def test_every_structure_about_every_equilibrium(analysed: Path) -> None:
    found: xr.Dataset = datasets.read(analysed, "spectrum")
    assert found["structure"].values.tolist() == ["intact", "altered", "cloaked"]
    assert found["state"].values.tolist() == ["at rest", "loaded"]
    assert (found["frequency"] > 0).all()
    assert (found["frequency"].diff("mode") >= 0).all()
    void = found["region"] == 3
    assert found["mode_shape"].sel(structure="cloaked", unit=void).isnull().all()
    size = np.hypot(*found["mode_shape"].transpose("dof", ..., "unit").values[:2])
    assert np.nanmax(size, axis=-1) == pytest.approx(1.0)
    assert (found["equilibrium"].sel(state="at rest").fillna(0) == 0).all()
    pushed = found["equilibrium"].sel(state="loaded", dof="ux", unit=4).values
    assert pushed == pytest.approx(-3.0)
    sound = found["band_frequency"].isel(wave=[0, -1], band=slice(2)).values
    assert np.abs(sound).max() < 1e-2
    assert found["lateral_strain"].values == pytest.approx([0.0, -0.02], abs=1e-4)


def test_every_load_case_has_its_equilibrium(design: Path, tmp_path: Path) -> None:
    options(tmp_path)
    path, out = tmp_path / "problem.yaml", tmp_path / "spectrum.nc"
    path.write_text(path.read_text().replace("[180 deg]", "[180 deg, 0 deg]"))
    words = ["--problem", str(path), "--design", str(design), "--out", str(out), "--quiet"]
    assert run_stage("spectrum", words) == 0
    found: xr.Dataset = datasets.read(out, "spectrum")
    loaded = ["loaded, case 0 (180 deg)", "loaded, case 1 (0 deg)"]
    assert found["state"].values.tolist() == ["at rest", *loaded]
    pushed, pulled = (found.sel(state=name) for name in loaded)
    assert pushed["equilibrium"].sel(dof="ux", unit=4).values == pytest.approx(-3.0)
    assert pulled["equilibrium"].sel(dof="ux", unit=4).values == pytest.approx(3.0)
    assert (abs(pulled["frequency"] / pushed["frequency"] - 1) > 1e-3).any("mode").all()
    assert found["transmission"].sizes["case"] == 2
    drawn = ["--problem", str(path), "--quiet", "--spectrum", str(out), "--out-dir", str(tmp_path)]
    assert main(["spectrum", *drawn]) == 0
    page = (tmp_path / "index.html").read_text()
    assert "cloaked, loaded" in page
    assert "voided, loaded" in page
    assert "Lowest modes loaded, case 0 (180 deg)" in page


def test_what_cannot_be_analysed_is_told(design: Path, tmp_path: Path, failing: Failing) -> None:
    wrong = {
        "spectrum": ["--problem", str(write(tmp_path, HOLE, size=5, amplitude=3.0)), "--quiet"],
        "spectrum.modes": options(tmp_path / "many", modes=500),
        "spectrum.compressions": options(tmp_path / "folded", compression=0.7),
    }
    given = ["--design", str(design), "--out", str(tmp_path / "spectrum.nc")]
    for key, words in wrong.items():
        told = failing("spectrum", [*words, *given])
        assert f"key:    {key}\n" in told
        assert "problem.yaml" in told


@pytest.mark.slow
def test_the_page_holds_the_figure_and_its_curves(analysed: Path, tmp_path: Path) -> None:
    pages = []
    for name in ("one", "two"):
        out = tmp_path / name
        words = [*options(tmp_path), "--spectrum", str(analysed), "--out-dir", str(out)]
        assert main(["spectrum", *words]) == 0
        pages.append({path.name: path.read_bytes() for path in out.iterdir()})
    assert pages[0] == pages[1]
    assert b"<svg" in pages[0]["index.html"]
    assert pages[0]["modes.csv"].startswith(b"structure,state,mode,value_Hz\n")
    assert pages[0]["modes.csv"].count(b"\n") == 1 + 3 * 2 * 4


def test_the_page_of_a_draft_says_so(analysed: Path, tmp_path: Path) -> None:
    words = options(tmp_path)
    as_draft(tmp_path / "problem.yaml", 8)
    drawn = ["--spectrum", str(analysed), "--out-dir", str(tmp_path / "page")]
    assert main(["spectrum", *words, "--preset", "quick", *drawn]) == 0
    page = (tmp_path / "page/index.html").read_text()
    assert "DRAFT — a quick look, not the study itself: 4 evaluations" in page


def test_a_spectrum_of_another_problem_is_refused(
    analysed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [*options(tmp_path, modes=3), "--spectrum", str(analysed), "--out-dir", str(tmp_path)]
    assert main(["spectrum", *words]) == 2
    assert "another problem" in capsys.readouterr().err
