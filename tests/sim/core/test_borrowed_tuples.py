"""Checks that what is not counted is neither kept for ever nor freed while it is used."""

import gc
import sys
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba.core import runtime

from sim.core import Floats, compiled


class Pair(NamedTuple):
    first: Floats
    second: Floats


class Nest(NamedTuple):
    pair: Pair
    third: Floats


@compiled
def add_up(nest: Nest, times: int) -> float:
    """Names parts of a tuple again and again, and puts new ones together of them."""
    total = 0.0
    for _ in range(times):
        pair = nest.pair
        turned = Pair(pair.second, pair.first)
        total += turned.first[0] - 2.0 * turned.second[0] + nest.third[0]
    return total


@compiled
def make(size: int) -> Nest:
    return Nest(Pair(np.ones(size), np.full(size, 2.0)), np.full(size, 3.0))


@compiled
def swapped(nest: Nest) -> Pair:
    return Pair(nest.pair.second, nest.third)


@compiled
def use_own(given: Nest, size: int) -> float:
    """Uses a tuple that it is given beside one that it makes and one that another makes."""
    own, made = Pair(np.full(size, 5.0), given.third), make(size)
    part = made.pair
    return float(own.first.sum() + own.second.sum() + part.second.sum() + swapped(made).second[0])


class Triple(NamedTuple):
    first: Floats
    second: Floats
    third: Floats


@compiled
def regrouped(size: int) -> float:
    """Keeps arrays of a tuple that another made in one of its own, which outlives that."""
    made = make(size)
    own = Triple(made.third, made.pair.second, made.pair.first)
    total = 0.0
    for _ in range(3):
        other = make(size)  # takes the memory of what has been freed
        other.third[:] = 100.0
        total += own.first[size - 1] + own.second[size - 1] + own.third[size - 1]
    return total


@pytest.fixture
def nest() -> Nest:
    return Nest(Pair(np.array([1.0]), np.array([2.0])), np.array([3.0]))


def counts(nest: Nest) -> list[int]:
    return [sys.getrefcount(array) for array in (*nest.pair, nest.third)]


def test_tuples_that_are_given_are_left_as_they_are(nest: Nest) -> None:
    before = counts(nest)
    assert add_up(nest, 1000) == 3000.0
    assert counts(nest) == before


def test_tuples_that_are_made_live_as_long_as_they_are_used(nest: Nest) -> None:
    before = counts(nest)
    assert use_own(nest, 1000) == 5000.0 + 3.0 + 2000.0 + 3.0
    out = swapped(nest)
    assert out.first is not out.second
    np.testing.assert_array_equal(np.concatenate(out), [2.0, 3.0])
    del out
    gc.collect()
    assert counts(nest) == before


def test_arrays_that_another_made_live_in_an_own_tuple() -> None:
    assert regrouped(1000) == 18.0


def test_nothing_stays_behind(nest: Nest) -> None:
    memory: Any = runtime  # without types of its own
    memory._nrt_python.memsys_enable_stats()
    use_own(nest, 10)
    gc.collect()
    before = memory.rtsys.get_allocation_stats()
    for _ in range(20):
        use_own(nest, 10)
        made = make(5)
        assert made.pair.second.sum() == 10.0
    del made
    gc.collect()
    after = memory.rtsys.get_allocation_stats()
    assert after.alloc - before.alloc == after.free - before.free
