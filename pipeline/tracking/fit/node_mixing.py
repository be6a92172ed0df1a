"""Mixes the nodes of a template about a pixel, the four numbers that each holds at once.

They lie side by side and make one vector of a processor, which LLVM finds in loops alone.
"""

from typing import Any

from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

_SUMS = ("reassoc", "contract", "arcp", "nsz")
_FOUR = ir.VectorType(ir.FloatType(), 4)
_PLACE, _COUNT = ir.IntType(32), ir.IntType(64)


@intrinsic
def _mix_nodes(
    context: Any,  # noqa: ANN401, ARG001
    nodes: Any,  # noqa: ANN401
    upper: Any,  # noqa: ANN401
    lower: Any,  # noqa: ANN401
    weights: Any,  # noqa: ANN401
    out: Any,  # noqa: ANN401
    first: Any,  # noqa: ANN401
    stride: Any,  # noqa: ANN401
) -> Any:  # noqa: ANN401
    """Weighs four nodes: two from ``upper`` on, the two below from ``lower`` on.

    Writes to ``out``, from ``first`` on in strides: the mean of each number (brightness, slopes,
    weight); the slope in x of the right nodes alone, and the slope in y of the lower ones alone.

    Args:
        context: of the compiler.
        nodes: (4 n,) singles.
        upper: index of the first number of the upper left node.
        lower: of the one below.
        weights: of upper left, upper right, lower left and lower right.
        out: singles.
        first: index of the first number written.
        stride: from one to the next.
    """
    signature = types.void(nodes, upper, lower, weights, out, first, stride)

    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:  # noqa: ANN401
        kinds = signature.args

        def numbers(which: int) -> Any:  # noqa: ANN401
            return context.make_array(kinds[which])(context, builder, given[which]).data

        def node(index: Any) -> Any:  # noqa: ANN401
            place = builder.gep(numbers(0), [index])
            return builder.load(builder.bitcast(place, _FOUR.as_pointer()), align=4)

        def weighed(which: int, values: Any) -> Any:  # noqa: ANN401
            weight, undefined = builder.extract_value(given[3], which), _FOUR(ir.Undefined)
            single = builder.insert_element(undefined, weight, _PLACE(0))
            same = ir.Constant(ir.VectorType(_PLACE, 4), [0] * 4)
            spread = builder.shuffle_vector(single, undefined, same)
            return builder.fmul(spread, values, flags=_SUMS)

        def total(first: Any, second: Any) -> Any:  # noqa: ANN401
            return builder.fadd(first, second, flags=_SUMS)

        corners = [builder.add(at, _COUNT(more)) for at in given[1:3] for more in (0, 4)]
        left, right, low_left, low_right = (
            weighed(which, node(index)) for which, index in enumerate(corners)
        )
        beside, below = total(right, low_right), total(low_left, low_right)
        mean = total(total(left, low_left), beside)
        told = [(mean, place) for place in range(4)] + [(beside, 1), (below, 2)]
        at = given[5]
        for values, place in told:
            builder.store(
                builder.extract_element(values, _PLACE(place)), builder.gep(numbers(4), [at])
            )
            at = builder.add(at, given[6])
        return context.get_dummy_value()

    return signature, generate


mix_nodes: Any = _mix_nodes
