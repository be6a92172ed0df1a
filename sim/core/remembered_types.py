"""Remembers the types that Numba's own functions return.

Numba asks dozens of templates, most of them for dates, texts and lists, what two numbers add up to,
and it asks them anew for each sum and in each round of type inference: an eighth of what it takes
to compile a loop.
"""

from __future__ import annotations

from typing import Any

from numba.core.types import functions

Arguments = tuple[Any, ...]

_types: Any = functions  # without types of its own

_known: dict[tuple[Any, Arguments], Any] = {}
"""Signatures by function and types of its arguments."""


def install() -> None:
    """Makes Numba remember them in this process."""
    ask = _types.BaseFunction.get_call_type

    def remember(function: Any, context: Any, given: Arguments, named: Any) -> Any:  # noqa: ANN401
        if named or type(function) is not _types.Function:
            return ask(function, context, given, named)
        signature = _known.get((function, given))
        if signature is None:
            signature = ask(function, context, given, named)
            if _is_its_own(function, signature):
                _known[function, given] = signature
        else:
            function._impl_keys[signature.args] = function.typing_key
        return signature

    _types.BaseFunction.get_call_type = remember


def _is_its_own(function: Any, signature: Any) -> bool:  # noqa: ANN401  (Numba's own, untyped)
    """Tells whether a call is implemented by the function itself, not by text compiled for it."""
    return signature is not None and (
        function._impl_keys.get(signature.args) is function.typing_key
    )
