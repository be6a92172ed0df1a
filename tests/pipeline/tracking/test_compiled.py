"""Loops whose sums may be reordered call those alone that are compiled in the same way.

That they are the same to the bit from the cache: ``tests/slow/test_cached_loops.py``.
"""

import importlib
import inspect
from collections.abc import Iterator
from types import ModuleType

import pytest
from numba.core.registry import CPUDispatcher

MODULES = ("compared_pixels", "normal_equations", "patch_correlation", "template", "template_cells")
NAMES = [*(f"pipeline.tracking.fit.{name}" for name in MODULES), "pipeline.virtual_lab.coverage"]


def loops(module: ModuleType) -> Iterator[CPUDispatcher]:
    return (each for _, each in inspect.getmembers(module) if isinstance(each, CPUDispatcher))


def called(loop: CPUDispatcher) -> Iterator[CPUDispatcher]:
    function = loop.py_func
    found = (function.__globals__.get(name) for name in function.__code__.co_names)
    return (each for each in found if isinstance(each, CPUDispatcher))


@pytest.mark.parametrize("name", NAMES)
def test_a_compiled_loop_calls_those_of_its_kind_only(name: str) -> None:
    for loop in loops(importlib.import_module(name)):
        for other in called(loop):
            for option in ("fastmath", "error_model"):
                assert other.targetoptions[option] == loop.targetoptions[option], (loop, other)
            inlined = other.targetoptions.get("inline") == "always"
            assert inlined or other.targetoptions["_nrt"] is False, (loop, other)


def test_there_are_such_calls() -> None:
    patch = importlib.import_module("pipeline.tracking.fit.patch_correlation")
    assert len(list(called(patch.fit_patches))) > 2
