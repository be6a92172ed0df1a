"""Adds rows of four numbers times matrices of four by four, in vector registers.

Numba lets LLVM vectorise loops, not four statements in a row; so this one is written in LLVM's own
instructions. Where the processor has them, products are added without rounding in between.
"""

from collections.abc import Callable
from typing import Any, cast

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from sim.core import Floats

WIDTH = 4
"""Numbers in a row: those of a vector register (AVX2)."""

_INDEX = ir.IntType(32)
_ROW = ir.VectorType(ir.DoubleType(), WIDTH)
_types: Any = types  # without types of its own, as the next
_build: Any = cgutils


def _pack(builder: Any, numbers: Any) -> Any:  # noqa: ANN401  (LLVM values)
    """Packs four numbers in a vector."""
    made = ir.Constant(_ROW, ir.Undefined)
    for i, number in enumerate(numbers):
        made = builder.insert_element(made, number, ir.Constant(_INDEX, i))
    return made


def _add_row_product(
    _: Any, values: Any, target: Any, share: Any, source: Any, factors: Any  # noqa: ANN401, ARG001
) -> Any:  # noqa: ANN401  # fmt: skip
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:  # noqa: ANN401
        array, at, kept, read, packed = given
        data = context.make_array(signature.args[0])(context, builder, array).data
        factor = _build.unpack_tuple(builder, packed)
        kind = ir.FunctionType(_ROW, [_ROW] * 3)
        multiply_add = _build.get_or_insert_function(builder.module, kind, "llvm.fmuladd.v4f64")
        place = builder.bitcast(builder.gep(data, [at]), _ROW.as_pointer())
        total = builder.fmul(_pack(builder, [kept] * WIDTH), builder.load(place, align=8))
        for i in range(WIDTH):
            entry = builder.gep(data, [builder.add(read, ir.Constant(read.type, i))])
            number = _pack(builder, [builder.load(entry)] * WIDTH)
            row = _pack(builder, factor[WIDTH * i : WIDTH * (i + 1)])
            total = builder.call(multiply_add, [number, row, total])
        builder.store(total, place, align=8)
        return context.get_dummy_value()

    kinds = (values, _types.intp, _types.float64, _types.intp, factors)
    return _types.void(*kinds), generate


add_row_product = cast(
    Callable[[Floats, int, float, int, tuple[float, ...]], None], intrinsic(_add_row_product)
)
"""Replaces a row t of values by share t + s F, with the row s and the matrix F (16 numbers, rows
first): ``values``, where t starts, ``share``, where s starts, F; for compiled loops. Nothing checks
that the rows are within the values."""
