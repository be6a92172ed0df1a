"""Every example runs, is short, gives the numbers that are pinned here, and is on the page."""

import runpy
import sys

import pytest

from pipeline.runtime import ROOT

FOLDER = ROOT / "docs/examples"
PINNED: dict[str, dict[str, float]] = {
    "band_diagram": {"highest": 4646.01, "gap": 25.3542},
    "contact_laws": {
        "largest_by_angle": 28.9571,
        "largest_by_distance": 41.4681,
        "smallest_by_distance": 0.0887502,
    },
    "custom_lattice": {"force": 14.6877, "n_units": 24.0, "n_ligaments": 37.0},
    "custom_loss": {"turn_deg": -15.6055, "steepest": 1.15457},
    "cut_units": {"n_parts": 9.0, "cut_length": 457.565, "widest": 0.0},
    "energy_balance": {},
    "error_estimate": {"draft": 0.00209083, "default": 0.00149858},
    "gradient_by_stiffness": {"axial": 0.0200955, "shear": -0.0110401, "bending": -0.00905535},
    "harmonic_wave": {"arrived": 128.0},
    "hidden_void": {"before": 0.116888, "after": 0.0350505},
    "imperfect_copies": {"spread": 0.031412},
    "kagome": {"force": 213.694, "largest_bend": 10.6188},
    "lattices_by_name": {"honeycomb": 0.506401, "triangular": 83.2005},
    "measured_drive": {"largest": 1.40942},
    "modes": {"first": 26.5758, "second": 42.3536, "third": 56.1552},
    "resumed_run": {"replayed": 3.0, "best": 3.04245},
    "robust_design": {"largest_by_mean": 0.0501224, "largest_by_worst": 0.0352884},
    "shielding_cloak": {"before": 0.0466899, "after": 0.00230091},
    "smallest_gap": {"smallest": 0.0, "overlaps": 2.0, "void_angle": -14.8265},
    "static_cloak": {"before": 3.50025, "after": 0.488018},
    "static_compression": {"stiffness": 2.20316, "plateau": 12.4432, "contacts": 0.0},
    "symmetric_design": {"variables": 28.0, "without": 112.0},
    "taylor_test": {"loss": 15.1018, "slope": 1.9974},
    "track_video": {"rms_px": 0.014, "lost": 0.0},
    "transmission": {"largest": 5.04154, "at_100_hz": 0.508965},
    "void_from_image": {"n_cut": 55.0, "force": 3.53916},
}
NAMES = sorted(p.stem for p in FOLDER.glob("*.py") if p.stem not in ("render", "specimen"))
OPTIMISING = ("hidden_void", "resumed_run", "robust_design", "shielding_cloak")
"""Examples that take eight seconds and more: tests/slow runs them."""


@pytest.mark.parametrize("name", [name for name in NAMES if name not in OPTIMISING])
def test_an_example_gives_its_numbers(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check_numbers(name, monkeypatch)


def check_numbers(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs an example, and compares its numbers with those pinned."""
    monkeypatch.setattr(sys, "path", [str(FOLDER), *sys.path])
    made = runpy.run_path(str(FOLDER / f"{name}.py"))
    found = {key: float(made[key]) for key in PINNED[name]}
    assert found == pytest.approx(PINNED[name], rel=1e-3, abs=1e-9)
    assert made["figure"].axes


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_short_and_shown(name: str) -> None:
    code = (FOLDER / f"{name}.py").read_text()
    assert len(code.splitlines()) <= 60
    assert (FOLDER / f"{name}.png").is_file()
    assert code.partition("\n")[2].lstrip() in (ROOT / "docs/examples.md").read_text()
