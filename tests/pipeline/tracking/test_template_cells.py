import numpy as np

from pipeline.tracking.fit import template_cells

SIZE = 31


def _template() -> tuple[np.ndarray, np.ndarray]:
    """A bright half plane, blurred, with weight in a disc about the middle."""
    x, y = np.meshgrid(np.arange(SIZE) - 15.0, np.arange(SIZE) - 15.0)
    brightness = 100 / (1 + np.exp(-(x + 0.3 * y)))
    weight = np.clip(10 - np.hypot(x, y), 0, 1)
    return brightness.astype(np.float32), weight.astype(np.float32)


def test_cells_are_steep_where_the_brightness_changes_and_unfolded() -> None:
    brightness, weight = _template()
    made = template_cells.classify_templates(brightness[None], weight[None], np.array([50.0]))
    kind = made.kind[0]
    assert kind[15, 15] == template_cells.STEEP
    assert kind[15, 8] == template_cells.FLAT
    assert kind[15, 22] == template_cells.FLAT
    corners = weight[:-1, :-1] + weight[1:, :-1] + weight[:-1, 1:] + weight[1:, 1:]
    assert ((kind[:-1, :-1] != template_cells.EMPTY) == (corners > 0)).all()
    nodes = np.full((SIZE, SIZE, 4), np.nan, np.float32)
    template_cells.unfold(brightness, weight, made.span[0], nodes.reshape(-1))
    used = kind != template_cells.EMPTY
    for row, column in ((0, 0), (0, 1), (1, 0), (1, 1)):
        read = np.roll(used, (row, column), (0, 1))
        assert np.isfinite(nodes[read]).all()
        assert np.allclose(nodes[read][:, 0], brightness[read])
        assert np.allclose(nodes[read][:, 3], weight[read])
    slope = np.gradient(brightness.astype(float), axis=1)
    assert np.allclose(nodes[used][:, 1], slope[used], atol=3.0)
    assert np.isnan(nodes).any()
