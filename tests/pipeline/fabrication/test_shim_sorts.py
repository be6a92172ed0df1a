import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pipeline.fabrication.parts import SHIM_PLAY, Ligament
from pipeline.fabrication.units import sort_shims
from pipeline.problem.sections import Fabrication

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
