import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.base import scale_wide_numbers, style, typeset


def _axes(label: str, limits: tuple[float, float]) -> Axes:
    axes = Figure().add_subplot()
    axes.set(xlabel="$u$ (mm)", xlim=(0.0, 15.0), ylabel=label, ylim=limits)
    return axes


def _numbers(axes: Axes) -> list[str]:
    axes.get_figure(root=True).draw_without_rendering()  # type: ignore[union-attr]
    return [text.get_text() for text in axes.get_yticklabels()]


@pytest.mark.parametrize(
    ("label", "limits", "scaled", "number"),
    [
        ("Force (N)", (0.0, 4e-5), "Force (µN)", "40"),
        ("Force (N)", (-4e6, 4e6), "Force (MN)", "−4"),
        ("Mimicking error", (0.0, 0.001), "Mimicking error (10⁻³)", "0.2"),
        (r"Mean $|\theta|$ (°)", (0.0, 0.02), r"Mean $|\theta|$ (10⁻³ °)", "5"),
        ("$u_y$ (mm)", (-0.05, 0.05), "$u_y$ (µm)", "−40"),
        ("Force (N)", (0.0, 0.08), "Force (N)", "0.02"),
    ],
)
def test_the_power_of_wide_numbers_stands_in_the_label(
    label: str, limits: tuple[float, float], scaled: str, number: str
) -> None:
    axes = _axes(label, limits)
    scale_wide_numbers(axes)
    assert axes.get_ylabel() == scaled
    assert number in _numbers(axes)
    assert axes.get_xlabel() == "$u$ (mm)"
    assert axes.yaxis.get_offset_text().get_text() == ""


@pytest.mark.parametrize(
    ("limits", "label", "numbers"),
    [
        ((4e-11, 1.1e-9), "Loss $J$ (10⁻⁹)", {"0.1", "0.5", "1"}),
        ((4e-9, 1.1e-3), "Loss $J$", {"10⁻⁸", "10⁻³", ""}),
        ((0.04, 1.1), "Loss $J$", {"0.05", "0.1", "1"}),
    ],
)
def test_a_logarithmic_axis_of_many_decades_has_powers(
    limits: tuple[float, float], label: str, numbers: set[str]
) -> None:
    axes = _axes("Loss $J$", limits)
    style.log_values(axes)
    axes.set_ylim(limits)
    scale_wide_numbers(axes)
    assert axes.get_ylabel() == label
    assert numbers <= set(_numbers(axes))


def test_numbers_are_set_as_in_print() -> None:
    assert typeset("-4.58e-11") == "−4.58 × 10⁻¹¹"
