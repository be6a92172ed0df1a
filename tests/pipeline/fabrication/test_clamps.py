"""Clamps are closed solids: nowhere do jaws nearly meet the rim of the base below them."""

from pipeline.fabrication.fixtures import fixtures
from tests.pipeline.fabrication import handmade


def test_jaws_stand_back_from_the_rim() -> None:
    specimen = handmade.specimen()
    parts = {part.id: part for part in fixtures(specimen, handmade.ASKED, handmade.SPACING)}
    clamps = [
        part for name, part in parts.items() if name.startswith("CLAMP") and "LID" not in name
    ]
    assert clamps
    for clamp in clamps:
        _, base, jaws = (layer.area for layer in clamp.layers)
        assert base.contains(jaws)
        assert base.boundary.distance(jaws) > 0.01
