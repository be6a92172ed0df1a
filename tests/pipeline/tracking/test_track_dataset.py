import numpy as np
import xarray as xr

from pipeline.datasets.tables import TABLES
from pipeline.tracking.output import drive_displacement


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
