from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.posing import load_family
from pipeline.problem.reading import load, overlay_keys
from pipeline.stages import certify
from reports.__main__ import main
from reports.facts import claims
from reports.facts.fact_records import read_json
from sim.core import SimulationError
from sim.load_family import LoadLosses
from tests.pipeline import static
from tests.pipeline.conftest import Failing
from tests.pipeline.static import designed
from tests.tables import cases, refused

FAMILY = yaml.safe_load("""
objective: { loads: { directions: [0 deg, 180 deg], frequency: [1 Hz, 8 Hz] } }
optimiser: { methods: { sqp: { evaluations: 3 }, mma: null } }
lattice: { columns: 5, rows: 5 }
cloak: { disc: { radius: 22 mm } }
drive: { amplitude: 3 mm }
""")


def write(fig2: Path, folder: Path, **changes: object) -> Path:
    """Writes the study's draft with a family of loads laid over it."""
    content = yaml.safe_load(fig2.read_text())
    presets = content.pop("presets")
    whole = overlay_keys(overlay_keys(content, presets["quick"]), FAMILY)
    path = folder / "problem.yaml"
    path.write_text(yaml.safe_dump(overlay_keys(whole, changes)))
    return path


@pytest.fixture(scope="module")
def chosen(fig2: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A design of this draft, with its problem beside it."""
    return designed(write(fig2, tmp_path_factory.mktemp("draft")))


def test_a_design_is_certified(
    chosen: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certify, "LOADS", 12)
    monkeypatch.setattr(certify, "SEARCHES", 4)  # one alone may end in a lesser maximum
    path, out = chosen.with_name("problem.yaml"), tmp_path / "certificate.nc"
    words = ["--problem", str(path), "--quiet"]
    certified = [*words, "--design", str(chosen), "--out", str(out)]
    assert run_stage("certify", certified) == 0
    data = datasets.read(out, "certificate").squeeze("design")
    assert data["design"].item() == "cloaked"
    assert 1.0 <= data["load_frequency"].min() < data["load_frequency"].max() <= 8.0
    assert (data["load_amplitude"] == 3.0).all()
    assert data["found_loss"].max() >= 0.999 * data["loss"].max() > data["nominal_loss"]
    before = out.read_bytes()
    monkeypatch.setattr(LoadLosses, "value", None)  # the journal has them all
    assert run_stage("certify", certified) == 0
    assert out.read_bytes() == before


def certified(
    problem: Path, folder: Path, monkeypatch: pytest.MonkeyPatch, loads: int = 12
) -> dict[str, str]:
    """Certifies the design of a problem and simulates its worst load; options of the page."""
    monkeypatch.setattr(certify, "LOADS", loads)
    monkeypatch.setattr(certify, "SEARCHES", 2)
    words = ["--problem", str(problem), "--quiet"]
    files = {name: str(folder / f"{name}.nc") for name in ("design", "certificate", "response")}
    made = [*words, "--design", str(designed(problem))]
    assert run_stage("certify", [*made, "--out", files["certificate"]]) == 0
    made += ["--certificate", files["certificate"]]
    assert run_stage("simulate", [*made, "--out", files["response"]]) == 0
    return {f"--{name}": file for name, file in files.items()}


def page_of(problem: Path, files: dict[str, str], folder: Path, *more: str) -> str:
    words = ["--problem", str(problem), *more, "--quiet", "--out-dir", str(folder)]
    assert main(["certificate", *words, *sum(files.items(), ())]) == 0
    return (folder / "index.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_page_shows_the_worst_load(
    fig2: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, page = write(fig2, tmp_path), tmp_path / "page"
    claim = {"study": tmp_path.name, "ours": "10", "relation": "below", "fact": "worst_found"}
    claim |= {"of": "simulation", "says": "loss under any load"}
    ours = claims.Claims.model_validate({"source": "this test", "claims": [claim]})
    monkeypatch.setattr(claims, "own", lambda: ours)
    files = certified(path, tmp_path, monkeypatch)
    text = page_of(path, files, page)
    assert "Our claims" in text
    assert "Claims that hold: 1 of 1 in simulation" in text
    data = datasets.read(Path(files["--certificate"]), "certificate").squeeze("design")
    response = datasets.read(Path(files["--response"]), "response").isel(case=0)
    found = max(float(data["loss"].max()), float(data["found_loss"].max()))
    relative = (3.0 / float(response["amplitude"])) ** 2 * response["loss"].sel(structure="cloaked")
    assert float(relative) == pytest.approx(found, rel=0.02)  # other steps

    assert "this design" in text
    assert 'id="player-data"' in text
    table = pd.read_csv(page / "certificate.csv", comment="#")
    np.testing.assert_allclose(table["loss (1)"], data["loss"], rtol=1e-6)
    facts = {fact.key: fact for fact in read_json(page / "facts.json")}
    assert facts["worst_found"].value == pytest.approx(found)
    altered = float(response["loss"].sel(structure="altered"))
    reduction = 1 - float(response["loss"].sel(structure="cloaked")) / altered
    assert facts["reduction"].value == pytest.approx(100 * reduction)
    assert "DRAFT" not in text
    static.as_draft(path, 30)
    assert "3 evaluations by SQP instead of 30" in page_of(
        path, files, tmp_path / "quick", "--preset", "quick"
    )
    own = {"study": f"{tmp_path.name}@quick"}  # which makes it a design in its own right
    ours = claims.Claims.model_validate({"source": "this test", "claims": [claim | own]})
    monkeypatch.setattr(claims, "own", lambda: ours)
    claimed = page_of(path, files, tmp_path / "claimed", "--preset", "quick")
    assert "DRAFT" not in claimed
    assert "Claims that hold: 1 of 1 in simulation" in claimed


FROM_ABOVE = (
    ", setups: [{ supports: [{ units: bottom }], drive: { kind: linear_ramp, units: top,"
    " amplitude: 3 mm, duration: 1 s, direction: 270 deg } }]"
)


@pytest.mark.slow
@pytest.mark.parametrize("setups", ["", FROM_ABOVE])
def test_the_page_of_a_path(setups: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ranges = f"target: intact, loads: {{ directions: [170 deg, 190 deg]{setups} }}"
    more = static.HOLE.replace("target: intact", ranges)
    path = static.write(tmp_path, more, size=5, amplitude=3.0)
    text = page_of(path, certified(path, tmp_path, monkeypatch), tmp_path / "page")
    assert ("set-up " in text) == bool(setups)
    assert "motion of the intact lattice" in text
    assert 'id="player-data"' in text
    table = pd.read_csv(tmp_path / "page" / "worst_load.csv", comment="#")
    worst = datasets.read(tmp_path / "response.nc", "response")
    reached = float(worst["amplitude"][0])
    assert table["displacement_mm"].iloc[[0, -1]].tolist() == pytest.approx([0.0, reached])


@pytest.mark.slow
def test_the_page_of_an_energy_shows_that(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    more = """
cloak: { ring: { inner: 8 mm, outer: 24 mm } }
objective:
  kind: strain_energy
  target: rest
  region: { disc: { radius: 8 mm } }
  loads: { directions: [170 deg, 190 deg] }
"""
    path, page = static.write(tmp_path, more, size=5, amplitude=3.0), tmp_path / "page"
    files = certified(path, tmp_path, monkeypatch)
    assert "Strain energy of the region of interest under the worst load" in page_of(
        path, files, page
    )
    response = datasets.read(Path(files["--response"]), "response").isel(case=0)
    table = pd.read_csv(page / "worst_load.csv", comment="#")
    energy = response["roi_energy"].sel(structure="cloaked")
    np.testing.assert_allclose(table["missed_cloaked_Nmm"], energy, rtol=1e-6, atol=1e-12)


def test_only_loads_in_ranges_are_certified(fig2: Path, tmp_path: Path, failing: Failing) -> None:
    words = ["--problem", str(fig2), "--design", "d.nc", "--out", str(tmp_path / "c.nc")]
    assert "objective.loads" in failing("certify", words)


@cases("stages", "changes, key")
def test_bad_ranges(fig2: Path, tmp_path: Path, changes: dict[str, object], key: str) -> None:
    with refused("", key):
        load(write(fig2, tmp_path, **changes))


TWO = """drives:
  - { kind: linear_ramp, units: top, amplitude: 3 mm, duration: 1 s, direction: 270 deg }
  - { kind: linear_ramp, units: { units: [[4, 1], [4, 2]] }, amplitude: 4 mm, duration: 1 s,
      direction: 180 deg }
"""


@cases("stages", "ranges, key, what")
def test_ranges_of_two_drives(tmp_path: Path, ranges: str, key: str | None, what: str) -> None:
    path = static.write(tmp_path, static.HOLE, size=5, amplitude=3.0)
    before, _, after = path.read_text().partition("drive:\n")
    rest = after[after.index("horizon:") :]
    loads = f"target: intact, loads: {{ {ranges} }}"
    text = before + TWO + rest.replace("target: intact", loads)
    path.write_text(text.replace("units: left", "units: bottom"))
    if key is None:
        assert load(path).objective.loads is not None
        return
    with refused(what, key):
        load(path)


def test_ranges_left_out_are_the_drives_own(fig2: Path) -> None:
    own = load(fig2, "unbiased").objective.loads
    assert own is not None
    assert own.amplitude == (1.0, 4.5)
    assert own.directions == (0.0, np.pi)
    assert own.nominal == 0.0


def test_set_ups_have_loads_of_their_own(fig2: Path) -> None:
    path = fig2.parents[1] / "fig5" / "problem.yaml"
    family = load_family(load(path, "unbiased"), path.parent)
    assert family is not None
    own, turned, plates = family.setups
    assert (own.amplitude, turned.amplitude, plates.amplitude) == ((1.5, 21.0),) * 3
    np.testing.assert_allclose(np.rad2deg(turned.direction), [180.0, 360.0])
    assert (own.scene, plates.own_amplitude) == (None, np.hypot(15.0, 15.0))
    assert turned.scene is not None
    assert set(turned.scene.loads.clamped // 3).isdisjoint(turned.scene.loads.driven)
    middle = family.numbers(np.array([[0.5, 0.5, 5 / 6]]))
    np.testing.assert_allclose(middle, [[np.pi / 4, 11.25]])


@pytest.mark.parametrize("copies", [0, 2])
def test_copies_that_do_not_count_are_warned_of(
    fig2: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture, copies: int
) -> None:
    path = write(fig2, tmp_path, objective={"robust": {"copies": copies}})
    certify.loads_in_ranges(load(path), path)
    assert ("not of the 2 imperfect copies" in caplog.text) == bool(copies)


def test_searches_that_come_to_no_load_are_told(
    chosen: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unsolvable(*_: object) -> None:
        raise SimulationError("no equilibrium")

    monkeypatch.setattr(certify, "LOADS", 2)
    monkeypatch.setattr(certify, "SEARCHES", 1)
    path, out = chosen.with_name("problem.yaml"), tmp_path / "certificate.nc"
    words = ["--problem", str(path), "--quiet", "--design", str(chosen)]
    monkeypatch.setattr(LoadLosses, "__call__", unsolvable)
    assert run_stage("certify", [*words, "--out", str(out)]) == 0
    data = datasets.read(out, "certificate")
    assert np.isnan(data["found_loss"]).all()
    assert np.isfinite(data["loss"]).all()


def test_a_range_of_one_value_is_the_drives(fig2: Path, tmp_path: Path) -> None:
    text = yaml.safe_load(write(fig2, tmp_path).read_text())
    text["objective"]["loads"]["amplitude"] = ["2.5 mm", "2.5 mm"]
    (tmp_path / "problem.yaml").write_text(yaml.safe_dump(text))
    with refused("one value", "objective.loads.amplitude"):
        load(tmp_path / "problem.yaml")
