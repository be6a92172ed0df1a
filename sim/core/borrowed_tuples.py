"""Counts no references to tuples that a loop is only given.

Numba counts a reference to each array in a tuple whenever a variable names that tuple or a part of
it, and takes it back at the variable's last use: with tuples of tens of arrays a third of what it
compiles. Whoever calls a loop keeps what it gives as long as the loop runs; so only tuples that a
loop makes, or gets from one that it calls, need counting there.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

from numba.core import ir, types
from numba.core.lowering import BaseLower
from numba.core.runtime.context import NRTContext

from sim.core.loop_cache import ROOT

Kinds = frozenset[types.Type]

_BORROWING = ("getattr", "static_getitem", "cast", "phi")
"""Expressions whose tuple belongs to their operand."""

_counted: list[Kinds | None] = [None]
"""Types of tuples that the loops being lowered count, the innermost last; None: all."""


def install() -> None:
    """Makes Numba compile the loops of this project so in this process."""
    lowering, runtime = cast(Any, BaseLower), cast(Any, NRTContext)
    lower, count = lowering.lower, runtime._call_incref_decref

    def lower_counted(function: Any) -> Any:  # noqa: ANN401  (Numba's own, untyped)
        _counted.append(counted_tuples(function))
        try:
            return lower(function)
        finally:
            _counted.pop()

    def count_if_made(context: Any, builder: Any, kind: Any, *rest: Any) -> Any:  # noqa: ANN401
        counted = _counted[-1]
        if isinstance(kind, types.BaseTuple) and counted is not None and kind not in counted:
            return None
        return count(context, builder, kind, *rest)

    lowering.lower, runtime._call_incref_decref = lower_counted, count_if_made


def counted_tuples(function: Any) -> Kinds | None:  # noqa: ANN401  (a Lower of Numba)
    """Finds the types of tuples that a function may own, parts of them included; None: all."""
    if not _is_ours(Path(function.func_ir.loc.filename)):
        return None
    kinds: dict[str, types.Type] = function.fndesc.typemap
    if any(map(_keeps, kinds.values())):
        return None
    made = [
        (kinds[assignment.target.name], assignment.value)
        for block in function.func_ir.blocks.values()
        for assignment in block.find_insts(ir.Assign)
        if not _borrows(assignment.value)
    ]
    owned = [kind for kind, value in made if not _gathers(value, kinds)]
    if any(map(_holds_arrays, owned)):  # which tuples put together of them have to keep
        owned = [kind for kind, _ in made]
    return frozenset(part for kind in (*owned, function.fndesc.restype) for part in _parts(kind))


def _is_ours(file: Path) -> bool:
    return file.is_relative_to(ROOT) and "site-packages" not in file.relative_to(ROOT).parts


def _keeps(kind: types.Type) -> bool:
    """Tells whether values of a type, lists and their like, may keep tuples of arrays."""
    if not isinstance(kind, types.Container) or isinstance(kind, types.BaseTuple):
        return False
    return not isinstance(getattr(kind, "dtype", None), types.Number)


def _borrows(value: Any) -> bool:  # noqa: ANN401  (of an assignment)
    if isinstance(value, ir.Expr):
        return value.op in _BORROWING
    return isinstance(value, ir.Arg | ir.Var)


def _gathers(value: Any, kinds: dict[str, types.Type]) -> bool:  # noqa: ANN401
    """Tells whether an expression puts a tuple together of what there is."""
    if not isinstance(value, ir.Expr):
        return False
    if value.op == "call":
        return isinstance(kinds[value.func.name], types.NamedTupleClass)
    return bool(value.op == "build_tuple")


def _parts(kind: types.Type) -> Iterator[types.Type]:
    """Lists the tuples in a type, itself included."""
    if isinstance(kind, types.BaseTuple):
        yield kind
        for part in _fields(kind):
            yield from _parts(part)


def _holds_arrays(kind: types.Type) -> bool:
    """Tells whether values of a type hold references to arrays."""
    if isinstance(kind, types.BaseTuple):
        return any(map(_holds_arrays, _fields(kind)))
    return isinstance(kind, types.Array)


def _fields(kind: types.BaseTuple) -> tuple[types.Type, ...]:
    return tuple(cast(Any, kind))
