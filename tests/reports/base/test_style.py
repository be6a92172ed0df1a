import warnings
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import Colormap, to_rgb
from matplotlib.font_manager import FontProperties, findfont

from reports.base import style
from tests.tables import tables


def lab(colours: Colormap) -> np.ndarray:
    return style.oklab(np.asarray(colours(np.arange(256)))[:, :3])


@pytest.mark.parametrize(
    "levels",
    [lab(style.MAGNITUDE), lab(style.SIGNED)[:128], lab(style.SIGNED)[128:]],
    ids=["magnitude", "below zero", "above zero"],
)
def test_neighbouring_levels_look_equally_different(levels: np.ndarray) -> None:
    steps = np.linalg.norm(np.diff(levels, axis=0), axis=1)
    assert steps.std() < 0.01 * steps.mean()


def test_magnitude_reads_in_grey_and_signed_is_palest_at_zero_and_balanced() -> None:
    assert (np.diff(lab(style.MAGNITUDE)[:, 0]) < 0).all()
    lightness = lab(style.SIGNED)[:, 0]
    assert lightness.argmax() in {127, 128}
    assert (np.diff(lightness)[:127] > 0).all()
    assert (np.diff(lightness)[128:] < 0).all()
    assert lightness[0] == pytest.approx(lightness[-1], abs=0.02)


VISION = {  # of linear RGB: Machado, Oliveira and Fernandes 2009, at full severity
    name: np.array(rows) for name, rows in tables("reports")["colour_vision"].items()
}


def seen(rgb: np.ndarray, kind: str) -> np.ndarray:
    """OKLab of sRGB colours as somebody without one kind of cones sees them."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    linear = np.clip(linear @ VISION[kind].T, 0.0, 1.0)
    powered = 1.055 * linear ** (1 / 2.4) - 0.055
    return style.oklab(np.where(linear <= 0.0031308, 12.92 * linear, powered))


@pytest.mark.parametrize("kind", VISION)
def test_maps_and_structures_can_be_told_apart_with_any_colour_vision(kind: str) -> None:
    maps, levels = (style.MAGNITUDE, style.SIGNED), np.arange(256)
    magnitude, signed = (seen(np.asarray(each(levels))[:, :3], kind) for each in maps)
    assert (np.diff(magnitude[:, 0]) < 0).all()
    assert np.linalg.norm(signed[40] - signed[215]) > 0.1
    colours = np.array([to_rgb(c) for c in (style.INTACT, style.ALTERED, style.CLOAKED)])
    shown = seen(colours, kind)
    apart = np.linalg.norm(shown[:, None] - shown[None], axis=2)[np.triu_indices(3, 1)]
    assert apart.min() > 0.15


def test_oklab_is_inverted() -> None:
    rgb = np.random.default_rng(1).random((50, 3))
    np.testing.assert_allclose(style.srgb(style.oklab(rgb)), rgb, atol=1e-6)


def test_style_ignores_the_settings_of_the_user_and_has_the_font_of_matplotlib() -> None:
    with mpl.rc_context({"axes.grid": True, "font.size": 30}), style.styled():
        assert not mpl.rcParams["axes.grid"]
        assert mpl.rcParams["font.size"] == style.TEXT
        found = Path(findfont(FontProperties(family=mpl.rcParams["font.family"])))
    assert found.resolve().is_relative_to(Path(mpl.get_data_path()).resolve())


def test_axes_have_the_size_that_they_will_have_in_print() -> None:
    figure = style.page(100.0)
    axes = style.place(figure, 10.0, 20.0, 50.0, 30.0)
    bounds = np.array(axes.get_position().bounds) * [178, 100, 178, 100]
    np.testing.assert_allclose(bounds, [10, 50, 50, 30])


def test_saved_files_have_the_same_bytes(tmp_path: Path) -> None:
    def saved(name: str) -> list[bytes]:
        (tmp_path / name).mkdir()
        with style.styled():
            figure = style.page(40.0)
            axes = style.place(figure, 10, 5, 60, 25)
            axes.plot([0, 1], [0, 1], label="line")
            axes.legend()
            paths = style.save(figure, tmp_path / name / "figure")
        return [path.read_bytes() for path in paths]

    assert saved("first") == saved("second")


def drawn(title: str, folder: Path) -> list[bytes]:
    """A figure with a title, in each format."""
    with style.styled():
        figure = style.page(30.0, 60.0)
        style.place(figure, 20.0, 10.0, 30.0, 15.0).set_title(title)
        return [path.read_bytes() for path in style.save(figure, folder / "figure")]


def test_characters_that_no_font_has_are_told_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(style, "FALLBACKS", ("No such font",))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drawn("心形 heart 心", tmp_path)
    (record,) = caplog.records
    assert "no font here has 心形: boxes stand for them" in record.getMessage()


def test_other_warnings_are_passed_on() -> None:
    with pytest.warns(UserWarning, match="something else"), style.styled():
        warnings.warn("something else", stacklevel=1)


def test_a_font_stands_in_where_the_own_lacks_a_character(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """And nowhere else: figures without such characters have the same bytes."""
    found = []
    for fonts in ((), ("STIXGeneral",)):
        monkeypatch.setattr(style, "FALLBACKS", fonts)
        found.append(drawn(r"A heart é, $\alpha$", tmp_path))
    assert found[0] == found[1]
    drawn("\u20dd", tmp_path)
    assert caplog.records == []
