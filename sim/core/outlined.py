"""Calls loops at their address: what few structures need is compiled where one needs it.

A loop takes a copy of each loop that it calls, which is compiled along with it whether or not it is
ever reached. A call at an address takes none; the address comes with the data, and is zero, and
nothing compiled, where the data ask for no such call.
"""

from collections.abc import Callable, Iterator
from typing import Any, TypeVar, cast

import numba
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.extending import intrinsic

R = TypeVar("R")

_numba: Any = numba  # without types of its own, as these
_types: Any = types
_build: Any = cgutils


def address_of(loop: Callable[..., Any], *arguments: object) -> int:
    """Compiles a `compiled` loop for arguments like these, and returns where its code is.

    Raises:
        TypingError: one of them is an array that is not contiguous.
    """
    dispatcher: Any = loop
    kinds = tuple(map(_numba.typeof, arguments))
    _check_contiguous(kinds)
    dispatcher.compile(kinds)
    made = dispatcher.overloads[kinds]
    return int(made.library.get_pointer_to_function(made.fndesc.llvm_cfunc_wrapper_name))


def _call_at(_: Any, address: Any, result: Any, arguments: Any) -> Any:  # noqa: ANN401  (types)
    _check_contiguous(arguments)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:  # noqa: ANN401
        given = _build.unpack_tuple(builder, values[2])
        returned = context.get_value_type(signature.return_type)
        kind = ir.FunctionType(returned, [each.type for each in given])
        return builder.call(builder.inttoptr(values[0], kind.as_pointer()), given)

    return _types.unliteral(result)(address, result, arguments), generate


call_at = cast(Callable[[int, R, tuple[Any, ...]], R], intrinsic(_call_at))
"""Calls the loop at an address with arguments, for compiled loops; it returns a `result`.

Nothing compares these with those that the loop was compiled for, but that arrays are contiguous.
"""


def _check_contiguous(kinds: Any) -> None:  # noqa: ANN401  (types in a tuple, or a type of one)
    """Refuses arrays that would be read as if they were contiguous."""
    for array in _arrays(kinds):
        if array.layout != "C":
            raise TypingError(f"{array} is not contiguous")


def _arrays(kinds: Any) -> Iterator[types.Array]:  # noqa: ANN401
    """Finds the arrays among types, in tuples as well."""
    for kind in kinds:
        if isinstance(kind, types.Array):
            yield kind
        elif isinstance(kind, types.BaseTuple):
            yield from _arrays(kind)
