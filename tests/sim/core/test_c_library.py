"""Python declares, C defines: arguments and results pass as both mean them."""

import weakref
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest

from sim.core import CLibrary, Floats, Ints
from sim.core.c_types import KEPT, SMALL


class Springs(NamedTuple):
    """Holds springs to the ground."""

    stiffness: Floats  # (n,)
    void: Ints  # (n,) a name that C keeps for itself
    gain: float


class Chain(NamedTuple):
    """Holds springs and what they share."""

    springs: Springs
    offset: int


DEFINED = """
#include "springs/declarations.h"

double test_c_library_energy(double *motion, const Chain *chain) {
    double total = 0.0;
    for (int64_t k = 0; k < chain->springs.n_stiffness; k++)
        total += 0.5 * chain->springs.stiffness[k] * motion[k] * motion[k];
    return chain->springs.gain * total + chain->offset + chain->springs.void_[0];
}

void test_c_library_double_all(double *values, int64_t n_values) {
    for (int64_t k = 0; k < n_values; k++) values[k] *= 2.0;
}

void test_c_library_divide(int64_t a, int64_t b, double *returned) {
    returned[0] = a / b, returned[1] = (double)a / b, returned[2] = a % b == 0;
}
"""


def energy(motion: Floats, chain: Chain) -> float:
    """Sums the energy."""
    raise NotImplementedError


def double_all(values: Floats, n_values: int = 0) -> None:
    """Doubles numbers."""
    raise NotImplementedError


def divide(a: int, b: int) -> tuple[int, float, bool]:
    """Divides whole numbers."""
    raise NotImplementedError


CHAIN = Chain(Springs(np.array([1.0, 3.0]), np.array([7]), 2.0), 100)


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> CLibrary:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    made = CLibrary(tmp_path / "springs")
    made.folder.mkdir()
    (made.folder / "springs.c").write_text(DEFINED)
    return made


@pytest.fixture
def bound(library: CLibrary) -> SimpleNamespace:
    """Binds the functions above to what C defines."""
    functions = {each.__name__: library.compiled(each) for each in (energy, double_all, divide)}
    library.header_file.write_text(library.declarations())
    return SimpleNamespace(**functions)


def test_records_arrays_and_numbers_reach_c(bound: SimpleNamespace) -> None:
    assert bound.energy(np.array([1.0, 2.0]), CHAIN) == 2.0 * (0.5 + 6.0) + 100 + 7


def test_records_in_turns_are_told_apart(bound: SimpleNamespace) -> None:
    chains = [CHAIN._replace(offset=100 * number) for number in range(KEPT + 2)]
    told = [float(bound.energy(np.ones(2), chain)) for chain in (*chains, *reversed(chains))]
    once = [11.0 + 100 * number for number in range(KEPT + 2)]
    assert told == [*once, *reversed(once)]
    stiffness = np.array([1.0, 3.0])
    chain = Chain(Springs(stiffness, np.array([7]), 2.0), 0)
    assert bound.energy(np.ones(2), chain) == 11.0
    stiffness[:] = 0.0
    assert bound.energy(np.ones(2), chain) == 7.0


@pytest.mark.parametrize(("size", "lives"), [(10, True), (SMALL // 8 + 1, False)])
def test_small_records_alone_live_on(bound: SimpleNamespace, size: int, lives: bool) -> None:
    stiffness = np.zeros(size)
    alive = weakref.ref(stiffness)
    bound.energy(np.ones(size), Chain(Springs(stiffness, np.array([7]), 2.0), 0))
    del stiffness
    assert (alive() is not None) == lives


def test_rows_are_counted_and_arrays_changed_in_place(bound: SimpleNamespace) -> None:
    values = np.arange(4.0)
    assert bound.double_all(values) is None
    np.testing.assert_array_equal(values, [0.0, 2.0, 4.0, 6.0])


def test_several_numbers_come_back_in_their_kinds(bound: SimpleNamespace) -> None:
    found = bound.divide(7, 2)
    assert found == (3, 3.5, False)
    assert [type(each) for each in found] == [int, float, bool]


@pytest.mark.parametrize(
    ("array", "kind"),
    [(np.arange(4), "of float64"), (np.arange(8.0)[::2], "contiguous")],
    ids=["integers", "every second"],
)
def test_arrays_that_c_would_misread_are_refused(
    bound: SimpleNamespace, array: Floats, kind: str
) -> None:
    with pytest.raises(TypeError, match=kind):
        bound.double_all(array)


def test_what_c_has_no_type_for_is_refused(library: CLibrary) -> None:
    def spell(word: str) -> None:
        raise NotImplementedError

    library.compiled(spell)
    with pytest.raises(TypeError, match="str"):
        library.declarations()


def test_a_header_of_other_declarations_is_refused(
    bound: SimpleNamespace, library: CLibrary
) -> None:
    header = library.header_file
    header.write_text(header.read_text().replace("int64_t offset;", "double offset;"))
    with pytest.raises(ImportError, match="run `python -m pipeline declarations`"):
        bound.energy(np.zeros(2), CHAIN)
