import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba.core.errors import TypingError

from sim.core import Floats, Ints, address_of, call_at, compiled

ROOT = Path(__file__).parents[3]


class Spring(NamedTuple):
    """A pair of arrays and a number, as structures are handed to loops."""

    stiffness: Floats
    scale: float
    calls: Ints


@compiled
def _add(motion: Floats, spring: Spring, out: Floats) -> float:
    total = 0.0
    for i in range(len(motion)):
        out[i] += spring.scale * spring.stiffness[i] * motion[i]
        total += out[i]
    return total


@compiled
def _clear(out: Floats) -> None:
    for i in range(len(out)):
        out[i] = 0.0


@compiled
def _work(motion: Floats, spring: Spring, out: Floats) -> float:
    if spring.calls[0] == 0:
        return -1.0
    call_at(spring.calls[1], None, (out,))
    return call_at(spring.calls[0], 0.0, (motion, spring, out))


def _spring(*calls: int) -> Spring:
    return Spring(np.array([1.0, 2.0, 3.0]), 2.0, np.array(calls))


def test_a_loop_is_called_at_its_address() -> None:
    motion, out = np.array([1.0, 1.0, 2.0]), np.full(3, np.nan)
    spring = _spring(address_of(_add, motion, _spring(0, 0), out), address_of(_clear, out))
    assert _work(motion, spring, out) == 18.0
    np.testing.assert_array_equal(out, [2.0, 4.0, 12.0])
    assert _work(motion, _spring(0, 0), out) == -1.0


def test_arrays_that_are_not_contiguous_are_refused() -> None:
    every_second = np.zeros(6)[::2]
    with pytest.raises(TypingError, match="not contiguous"):
        address_of(_clear, every_second)
    with pytest.raises(TypingError, match="not contiguous"):
        _work(np.zeros(3), _spring(0, 0), every_second)


LAWS = """
from sim.collision import find
from sim.energy import system_of
from sim.energy.distance_contact_kernels import add_gradient
from tests.sim.structures import shaken
rig = shaken()
system = system_of(rig.topology, rig.values)
print((system.calls != 0).sum(), len(add_gradient.overloads), len(find.callee.overloads))
"""


def test_a_structure_without_contact_on_distance_compiles_none_of_it(tmp_path: Path) -> None:
    places = {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path)}
    run = [sys.executable, "-c", LAWS]
    told = subprocess.check_output(run, env=os.environ | places, text=True, timeout=300)
    assert told == "0 0 0\n"
