import numpy as np
from matplotlib.figure import Figure

from reports.figures.loading_path import abscissa, curves


def test_zero_has_no_sign_on_a_path_to_the_left() -> None:
    motion = np.array([0.0, -15.0])
    path = abscissa.Abscissa("displacement", "u", "mm", motion, True, 0.1, (0, 1))
    assert [path.at(0), path.at(1)] == ["0 mm (0 %)", "−15 mm (10 %)"]
    made = Figure()
    curves.path_axes(made.add_subplot(), path, "")
    (above,) = made.axes[0].child_axes
    made.draw_without_rendering()
    assert [tick.get_text() for tick in above.get_xticklabels()] == ["0", "10"]
