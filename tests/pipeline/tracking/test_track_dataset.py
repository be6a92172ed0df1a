from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline.datasets.tables import TABLES
from pipeline.tracking.output import drive_displacement, track_table_path, write_track_table
from tests.tables import refused


def test_a_lost_driven_unit_does_not_move_the_drive() -> None:
    """A row that is pushed and tilted, as a grip that is not quite straight."""
    flag = TABLES["design"]["support"].flags["driven"]
    height = 15.0 * np.arange(15)
    corners = np.stack([np.zeros((15, 4)), height[:, None] + [-5.0, -5.0, 5.0, 5.0]], axis=-1)
    design = xr.Dataset(
        {
            "vertices": (("unit", "vertex", "xy"), corners),
            "support": ("unit", np.full(15, flag)),
        }
    )
    share = np.linspace(0.0, 1.0, 8)
    angle, row = np.deg2rad(1.0) * share[:, None], height - height.mean()
    sideways, along = 15.0 * share[:, None] - np.sin(angle) * row, (np.cos(angle) - 1.0) * row
    motion = np.stack([sideways, along, angle + 0.0 * row], axis=-1)
    pushed = np.stack([15.0 * share, 0.0 * share], axis=-1)
    np.testing.assert_allclose(drive_displacement(motion, design), pushed, atol=1e-12)
    motion[4:, -2:] = np.nan
    np.testing.assert_allclose(drive_displacement(motion, design), pushed, atol=1e-12)
    motion[6:, 1:] = np.nan
    assert np.isfinite(drive_displacement(motion, design)).all()
    motion[7] = np.nan
    assert np.isnan(drive_displacement(motion, design)[7]).all()


@pytest.mark.parametrize("synthetic", ["yes", "no"])
def test_a_table_replaces_none_but_its_own_kind(tmp_path: Path, synthetic: str) -> None:
    """A log of forces may lie where the table of a track would."""
    out, table = tmp_path / "run.nc", tmp_path / "run.csv"
    assert track_table_path(out) == table
    for kept in ("time,force\n0,1\n", "# kN\ntime_s,unit\n", "", "Zeit;Kraft \xb0\n" * 99):
        table.write_text(kept, encoding="latin-1")
        with refused("would be written over", "--out", file=table, remedy="run.csv is put beside"):
            track_table_path(out)
    blank = xr.Dataset(
        {name: ("unit", np.zeros(0, int)) for name in ("unit", "i", "j")}
        | {name: (("time", "unit"), np.zeros((0, 0))) for name in ("quality", "displacement")}
        | {"sigma": (("time", "unit"), np.zeros((0, 0))), "time": ("time", np.zeros(0))}
        | {"load_force": ("time", np.zeros(0))}
        | {"drive_displacement": (("time", "xy"), np.zeros((0, 2)))},
        attrs={"synthetic": synthetic},
    )
    write_track_table(blank, table)
    assert track_table_path(out) == table
