from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import datasets
from pipeline.datasets import SYNTHETIC_LABEL, provenance
from reports.__main__ import main
from reports.base import style
from reports.products.calibration import draw_calibration
from tests.reports.figure_assertions import assert_legible, drawn, words

NAMES = ["bending_stiffness", "damping_ratio"]
POINTS = 30


def calibration(*, synthetic: bool = True) -> xr.Dataset:
    """A test of forces, and a track of seven units and a load cell."""
    random, along = np.random.default_rng(5), np.linspace(0.0, 1.0, POINTS)
    channels = np.repeat([0, *range(21), 23], POINTS)
    number = (np.arange(len(channels)) >= POINTS).astype(int)
    count = len(channels)
    fitted = np.tile(along, count // POINTS) * (1 + channels)
    correlation = np.array([[1.0, -0.4], [-0.4, 1.0]])
    error = np.array([0.02, 0.05])
    one, pair, point = ("parameter",), ("parameter", "with_parameter"), ("point",)
    of_set = dict.fromkeys(("freedom", "chi_square", "level", "autocorrelation"), 1.0)
    absent = dict.fromkeys(("peak_ratio", "peak_ratio_error"), np.nan)
    made = xr.Dataset(
        {
            **dict.fromkeys(("origin", "status"), (one, np.zeros(2, np.int8))),
            "start": (one, [1.6, 0.02]),
            "value": (one, [1.5, 0.0186]),
            "lower": (one, [1.44, 0.0168]),
            "upper": (one, [1.56, 0.0206]),
            **dict.fromkeys(("standard_error", "bound"), (one, error)),
            "covariance": (pair, correlation * np.outer(error, error)),
            "correlation": (pair, correlation),
            "condition": ((), 1.5),
            "newton_step": ((), 0.001),
            "points": ("set", np.bincount(number)),
            **{name: ("set", np.full(2, value)) for name, value in (of_set | absent).items()},
            "set_of_point": (point, number),
            "channel": (point, channels),
            "abscissa": (point, np.tile(along, count // POINTS)),
            "measured": (point, fitted + 0.02 * random.normal(size=count)),
            "fitted": (point, fitted),
            "sigma": (point, np.full(count, 0.02)),
            "residual": (point, random.normal(size=count)),
        },
        {
            "parameter": NAMES,
            "parameter_units": ("parameter", ["N mm/rad", "1"]),
            "with_parameter": NAMES,
            "set": ["shear", "motion"],
            "kind": ("set", ["force_displacement", "track"]),
        },
    )
    told = {"synthetic": "yes" if synthetic else "no", "warnings": "", "calibration": "{}"}
    return made.assign_attrs(told)


@pytest.mark.parametrize("synthetic", [True, False])
def test_only_what_was_computed_is_called_so_and_all_is_told(synthetic: bool) -> None:
    with style.styled():
        made = drawn(draw_calibration(calibration(synthetic=synthetic)))
    said = words(made)
    assert (SYNTHETIC_LABEL in said) == synthetic
    assert_legible(made)
    assert {"Shear", "Motion", "force, N", "Constants: 95 % intervals"} <= said
    assert any("= 1.5 N mm/rad" in text for text in said)
    forces, _, motion = made.axes[:3]
    assert len(forces.lines) == 2
    fits = [line for line in motion.lines if line.get_color() == style.CLOAKED]
    highest = [float(np.asarray(line.get_ydata())[-1]) for line in fits]
    assert sorted(highest) == [14.0, 16.0, 17.0, 19.0, 20.0]  # of ux and uy; not the load's 24 N


def test_any_number_of_sets_is_drawn() -> None:
    several = calibration().isel(set=[0] * 27, point=np.tile(np.arange(POINTS), 27))
    several["set_of_point"] = ("point", np.repeat(np.arange(27), POINTS))
    with style.styled():
        said = words(draw_calibration(several))
    assert {"a", "z", "aa", "ab"} <= said
    assert "ac" not in said


@pytest.mark.slow
def test_files_are_whole_and_the_same_every_time(tmp_path: Path) -> None:
    origin = provenance.of_recording("{}", {}, synthetic=True, role="calibration")
    source = tmp_path / "calibration.nc"
    datasets.write(calibration().drop_attrs(), source, "calibration", origin | {"warnings": ""})
    asked = ["calibration", "--calibration", str(source), "--quiet", "--out-dir"]
    assert [main([*asked, str(tmp_path / name)]) for name in ("one", "two")] == [0, 0]
    files = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert files == ["fit.pdf", "fit.png", "fit.svg"]
    for name in files:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    with pytest.raises(SystemExit):
        main(["calibration", "--calibration", str(source)])
