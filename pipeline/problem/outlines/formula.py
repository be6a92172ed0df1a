"""Formulas of a curve's parameter t, such as "16 * sin(t)^3": arithmetic and a few functions."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable

_BINARY: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: math.pow,
}
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    name: getattr(math, name) for name in ("sin", "cos", "tan", "exp", "sqrt", "tanh")
} | {"abs": abs}
_NAMES = {"pi": math.pi}
_LONGEST = 500


class FormulaError(ValueError):
    """A text that is no formula of t."""


def compiled(text: str) -> Callable[[float], float]:
    """The function that a formula means.

    Raises:
        FormulaError: not a formula, or an unknown name in it. The function raises it too, where it
            has no finite value.
    """
    try:
        tree = ast.parse(text[:_LONGEST].replace("^", "**").strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError) as error:
        raise FormulaError("not a formula") from error

    def value(t: float) -> float:
        try:
            found = _value(tree, {**_NAMES, "t": t})
        except (ArithmeticError, ValueError) as error:
            if isinstance(error, FormulaError):
                raise
            raise FormulaError(f"no value at t = {t:g}") from error
        if not math.isfinite(found):
            raise FormulaError(f"no finite value at t = {t:g}")
        return found

    value(0.5)
    return value


def _value(node: ast.expr, names: dict[str, float]) -> float:
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name) if name in names:
            return names[name]
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -_value(inner, names)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            return _BINARY[type(op)](_value(left, names), _value(right, names))
        case ast.Call(func=ast.Name(id=name), args=[inner], keywords=[]) if name in _FUNCTIONS:
            return _FUNCTIONS[name](_value(inner, names))
    known = ", ".join(["t", *_NAMES, *_FUNCTIONS])
    raise FormulaError(f"{ast.unparse(node)!r} is not understood (known: {known}, + - * / ^)")
