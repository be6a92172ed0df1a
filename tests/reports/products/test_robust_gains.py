import pytest
import xarray as xr

from reports.products.robust_gains import gains_table


def gains(unit: str) -> xr.Dataset:
    words = {name: ("preset", ["x"]) for name in ("asks", "loads", "copies")}
    losses = {
        name: ("preset", [0.25], {"units": unit}) for name in ("loss_plain", "loss_own", "price")
    }
    return xr.Dataset(words | losses, {"preset": ["robust"]})


@pytest.mark.parametrize(("unit", "end"), [("N mm", " (N mm)"), ("1", "")])
def test_losses_have_the_unit_of_their_heading(unit: str, end: str) -> None:
    table = gains_table(gains(unit))
    assert f"loss of the preset's design{end}" in table.columns
    assert "gain" in table.columns
    assert [len(row) for row in table.rows] == [len(table.columns)]
