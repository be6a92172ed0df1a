"""Checks that Numba is asked once for the types of a call, and told nothing wrong of others."""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numba import types
from numba.core.registry import cpu_target

from sim.core import remembered_types

CONTEXT: Any = cpu_target.typing_context
NUMBERS = (types.float64, types.int64)


def function(of: Callable[..., object]) -> Any:  # noqa: ANN401  (a type of Numba)
    CONTEXT.refresh()
    return CONTEXT.resolve_value_type(of)


@pytest.mark.parametrize(
    ("of", "given", "returned"),
    [
        (operator.add, NUMBERS, types.float64),
        (operator.lt, NUMBERS, types.boolean),
        (operator.getitem, (types.float64[::1], types.int64), types.float64),
        (operator.truediv, (types.int64, types.int64), types.float64),
    ],
)
def test_a_call_is_remembered(of: Callable[..., object], given: Any, returned: Any) -> None:  # noqa: ANN401
    kind = function(of)
    signature = kind.get_call_type(CONTEXT, given, {})
    kind._impl_keys.clear()  # as of an equal type that was asked for nothing yet
    assert kind.get_call_type(CONTEXT, given, {}) is signature
    assert signature.return_type == returned
    assert kind.get_impl_key(signature) is of


def test_text_compiled_for_a_call_is_asked_for_anew() -> None:
    kind, given = function(np.empty), (types.int64,)
    signature = kind.get_call_type(CONTEXT, given, {})
    assert (kind, given) not in remembered_types._known
    assert kind.get_impl_key(signature) is not np.empty
