import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from reports.panels.convergence import loss_history

CASES = ("method", "case", "evaluation")


def _history(losses: list[float]) -> xr.Dataset:
    """Makes the design of a search that accepted every evaluation."""
    loss = np.array(losses)
    ones = ("method", "evaluation"), np.ones((1, loss.size))
    return xr.Dataset(
        {
            "loss": (("method", "evaluation"), loss[None]),
            "loss_case": (CASES, loss[None, None]),
            "accepted": ones,
            "violation": (ones[0], np.zeros((1, loss.size))),
            "best_loss": ("method", [loss.min()]),
            "best_evaluation": ("method", [int(loss.argmin())]),
        },
        {"method": ["sqp"]},
    )


@pytest.mark.parametrize("best", [0, 6, 50, 99])
def test_number_of_the_best_loss_stands_clear_of_the_curve(best: int) -> None:
    # kicked off after the best, so that the curve passes above and to the right of it
    losses = (0.037 + 0.04 * np.exp(-((np.arange(100) - best - 1) % 32) / 8)).tolist()
    losses[best] = 0.0345
    axes = Figure(figsize=(2.2, 1.8), dpi=300).add_axes((0.2, 0.2, 0.75, 0.65))
    loss_history(axes, _history(losses))
    (label,) = axes.texts
    box = Bbox(label.get_window_extent().get_points())
    drawn = [line for line in axes.lines if line.get_linestyle() != "None"]
    paths = [line.get_transform().transform_path(line.get_path()) for line in drawn]
    assert label.get_text() == "0.0345"
    assert not any(path.intersects_bbox(box, filled=False) for path in paths)
    assert axes.bbox.x1 >= box.x1 - 1.0


def test_the_curve_of_every_load_case_is_on_the_panel() -> None:
    """Takes the lower limit from the least of them, where that is far below their mean."""
    made = _history([1.0, 0.4, 0.2])
    cases = np.stack([1.9 * made["loss"].values, 0.1 * made["loss"].values], axis=1)
    axes = Figure().add_subplot()
    loss_history(axes, made.drop_vars("loss_case").assign(loss_case=(CASES, cases)))
    low, high = axes.get_ylim()
    assert low < cases.min() < cases.max() < high
    loss_history(alone := Figure().add_subplot(), made)
    assert alone.get_ylim()[0] == pytest.approx(0.55 * 0.2)


def test_the_number_of_the_best_loss_is_in_the_unit_of_its_axis() -> None:
    made = _history([5e5, 9e4, 6.47e4])
    loss_history(axes := Figure().add_subplot(), made.assign(best_loss=("method", [6.47e4])))
    assert axes.get_ylabel() == "Loss $J$ (10³)"
    assert [text.get_text() for text in axes.texts] == ["64.7"]
