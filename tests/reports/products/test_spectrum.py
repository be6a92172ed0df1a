import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from reports.products.spectrum import bands_panel


def bands(shares: list[float]) -> xr.Dataset:
    sizes = {"compression": len(shares), "wave": 4, "band": 2}
    return xr.Dataset(
        {
            "band_frequency": (tuple(sizes), np.ones(tuple(sizes.values()))),
            "lateral_strain": ("compression", np.zeros(len(shares))),
        },
        {"compression": shares, "wave": np.linspace(0.0, 3.0, 4)},
    )


@pytest.mark.parametrize("count", [2, 4, 7])
def test_every_compression_has_its_bands_and_its_colour(count: int) -> None:
    shares = (0.01 * np.arange(count)).tolist()
    axes = Figure().add_subplot()
    bands_panel(axes, bands(shares))
    legend = axes.get_legend()
    assert legend is not None
    assert len(legend.get_texts()) == count
    assert len({to_hex(str(line.get_color())) for line in axes.lines}) == count
