import pytest
import xarray as xr

from reports.products.front import losses_table


def losses(unit: str) -> xr.Dataset:
    words = {name: ("design", ["1"]) for name in ("parameter", "setting")}
    numbers = {
        name: ("design", [0.25], {"units": unit})
        for name in ("nominal_loss", "worst_loss", "altered_loss")
    }
    return xr.Dataset(words | numbers, {"design": ["share.1"]})


@pytest.mark.parametrize(("unit", "told"), [("N mm", "worst found (N mm)"), ("1", "worst found")])
def test_losses_have_the_unit_of_their_heading(unit: str, told: str) -> None:
    table = losses_table(losses(unit), {})
    assert told in table.columns
    assert "over their mean" in table.columns
    assert [len(row) for row in table.rows] == [len(table.columns)]
