from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.problem.reading import load, overlay_keys
from pipeline.stages import certify
from reports.__main__ import main
from sim.load_family import LoadLosses
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


def test_a_design_is_certified(fig2: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certify, "LOADS", 12)
    monkeypatch.setattr(certify, "SEARCHES", 4)  # one alone may end in a lesser maximum
    path, out = write(fig2, tmp_path), tmp_path / "certificate.nc"
    words = ["--problem", str(path), "--quiet"]
    certified = [*words, "--design", str(designed(path)), "--out", str(out)]
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

    page = tmp_path / "page"
    shown = ["certificate", *words, "--certificate", str(out), "--out-dir", str(page)]
    assert main(shown) == 0
    assert "this design" in (page / "index.html").read_text(encoding="utf-8")
    table = pd.read_csv(page / "certificate.csv", comment="#")
    np.testing.assert_allclose(table["loss (1)"], data["loss"], rtol=1e-6)


def test_only_loads_in_ranges_are_certified(fig2: Path, tmp_path: Path, failing: Failing) -> None:
    words = ["--problem", str(fig2), "--design", "d.nc", "--out", str(tmp_path / "c.nc")]
    assert "objective.loads" in failing("certify", words)


@cases("stages", "changes, key")
def test_bad_ranges(fig2: Path, tmp_path: Path, changes: dict[str, object], key: str) -> None:
    with refused("", key):
        load(write(fig2, tmp_path, **changes))


def test_ranges_left_out_are_the_drives_own(fig2: Path) -> None:
    own = load(fig2, "unbiased").objective.loads
    assert own is not None
    assert own.amplitude == (1.0, 4.5)
    assert own.directions == (0.0, np.pi)
    assert own.nominal == 0.0
