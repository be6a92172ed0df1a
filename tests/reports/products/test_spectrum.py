import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from pipeline.problem.sections import Kagome
from reports.base import style
from reports.products.spectrum import bands_panel, zone_points


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
    bands_panel(axes, bands(shares), ("Γ", "X", "M", "Γ"))
    legend = axes.get_legend()
    assert legend is not None
    assert len(legend.get_texts()) == count
    colours = [to_hex(str(line.get_color())) for line in axes.lines]
    assert len(set(colours)) == count
    # all are of the intact lattice
    assert colours[0] == style.INTACT
    assert not {style.ALTERED, style.CLOAKED} & set(colours)


@pytest.mark.parametrize(
    ("angle", "wanted"), [(np.pi / 2, "Γ X M Γ"), (np.pi / 3, "Γ M K Γ")], ids=["right", "60 deg"]
)
def test_the_points_of_the_zone_are_named_by_its_shape(angle: float, wanted: str) -> None:
    lattice = Kagome.model_construct(cell_angle=angle)
    assert " ".join(zone_points(lattice)) == wanted
