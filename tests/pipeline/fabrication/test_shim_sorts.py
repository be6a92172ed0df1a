from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pipeline.fabrication.fixtures import shim_pieces
from pipeline.fabrication.parts import SHIM_PLAY, FlatPart, Ligament
from pipeline.fabrication.units import sort_shims
from pipeline.problem.sections import Fabrication
from tests.pipeline.fabrication import handmade

ASKED = Fabrication()
HAIR = 1e-6


def ligaments(lengths: list[float]) -> list[Ligament]:
    return [
        Ligament(number, (f"A{number}", f"B{number}"), length, 2.25, (0.0, 0.0))
        for number, length in enumerate(lengths)
    ]


@given(st.lists(st.floats(4.0, 12.0), min_size=1, max_size=60))
def test_each_ligament_has_a_shim_that_goes_in_and_is_hardly_short(lengths: list[float]) -> None:
    shims = sort_shims(ligaments(lengths), ASKED)
    taken = sorted(number for shim in shims for number in shim.ligaments)
    assert taken == list(range(len(lengths)))
    for shim in shims:
        play = np.array(lengths)[list(shim.ligaments)] - shim.length
        assert (play >= -HAIR).all()
        assert (play <= SHIM_PLAY + HAIR).all()
    assert len({shim.id for shim in shims}) == len(shims)


def test_nearly_equal_shims_are_one_sort() -> None:
    shims = sort_shims(ligaments([8.25, 6.4566, 6.4601, 6.5, 8.25, 6.5301]), ASKED)
    assert {shim.id: shim.ligaments for shim in shims} == {"S6.45": (1, 2, 3, 5), "S8.25": (0, 4)}


def marks(piece: FlatPart, turn: float = 1.0) -> set[tuple[float, ...]]:
    """Ends of strokes about the middle of a piece, or of one that is turned by 180 degrees."""
    middle = np.array(piece.size) / 2
    ends = (np.sort(turn * (stroke[[0, -1]] - middle), axis=0) for stroke in piece.engraving)
    return {tuple((np.round(each, 3) + 0.0).ravel().tolist()) for each in ends}


def test_a_length_that_is_read_upside_down_is_none() -> None:
    """Pieces are twisted out of their sheet: 6.8 mm would be 8.9 mm there."""
    one, lengths = handmade.specimen(), np.round(np.arange(6.0, 11.0, 0.05), 2).tolist()
    shims = [replace(one.shims[0], id=f"S{x:g}", length=x, spares=0) for x in lengths]
    specimen = replace(one, shims=tuple(replace(shim, ligaments=(0,)) for shim in shims))
    pieces = shim_pieces(specimen, ASKED)
    written = [marks(piece) for piece in pieces]
    assert all(written)
    assert not any(marks(piece, -1.0) in written for piece in pieces)


def test_mirrored_shims_are_listed_by_their_numbers() -> None:
    """Strains that differ by rounding alone tell no order."""
    whole = handmade.specimen()
    strains = {0: 0.02, 1: 0.1, 2: 0.1 + 3e-16, 3: 0.1 + 1e-13, 4: 0.1001}
    bent = [replace(one, strain=strains.get(one.number, 0.0)) for one in reversed(whole.ligaments)]
    found = replace(whole, ligaments=tuple(bent)).bent
    assert [one.number for one in found] == [4, 1, 2, 3, 0]
