"""Scales, turns and moves closed outlines, finds what lies within, and computes formulas of them.

A formula is one of a curve's parameter t, such as "16 * sin(t)^3".
"""

import ast
import math
import operator
from collections.abc import Callable, Sequence

Point = tuple[float, float]
Outline = tuple[Point, ...]

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
_AT_ONCE = 1000
"""Edges of an outline that all points are compared with at once: more would fill the memory."""


def find_inside(points: Sequence[Point], outlines: tuple[Outline, ...], hair: float) -> list[bool]:
    """Finds points within an odd number of closed outlines, or within `hair` of one."""
    import numpy as np

    px, py = np.array(points, dtype=float).reshape(-1, 2).T[..., None]
    odd, near = np.zeros(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
    for outline in outlines:
        start = np.array(outline)
        edges = np.concatenate([start, np.roll(start, -1, axis=0)], axis=1)
        for first in range(0, len(edges), _AT_ONCE):
            x1, y1, x2, y2 = edges[first : first + _AT_ONCE].T
            dx, dy = x2 - x1, y2 - y1
            along = ((px - x1) * dx + (py - y1) * dy) / np.maximum(dx * dx + dy * dy, 1e-300)
            share = np.clip(along, 0.0, 1.0)
            near |= (np.hypot(px - x1 - share * dx, py - y1 - share * dy) <= hair).any(axis=1)
            crossed = (y1 > py) != (y2 > py)
            ahead = px < x1 + (py - y1) * dx / np.where(dy == 0.0, 1.0, dy)
            odd ^= np.count_nonzero(crossed & ahead, axis=1) % 2 == 1
    return (odd | near).tolist()


def place_outline(
    outline: Outline, size: tuple[float, float], origin: Point, centre: Point, orientation: float
) -> Outline:
    """Scales an outline's box to `size`, moves `origin` to `centre`, and turns it about that."""
    scale_x, scale_y = (wanted / has for wanted, has in zip(size, extents(outline), strict=True))
    moved = tuple(
        (centre[0] + scale_x * (x - origin[0]), centre[1] + scale_y * (y - origin[1]))
        for x, y in outline
    )
    return turn_outline(moved, orientation, centre)


def turn_outline(outline: Outline, angle: float, centre: Point) -> Outline:
    """Turns an outline by `angle` (rad) about `centre`."""
    cosine, sine = math.cos(angle), math.sin(angle)
    arms = ((x - centre[0], y - centre[1]) for x, y in outline)
    return tuple(
        (centre[0] + cosine * x - sine * y, centre[1] + sine * x + cosine * y) for x, y in arms
    )


def extents(outline: Outline) -> tuple[float, float]:
    """Computes width and height of an outline's box."""
    width, height = (max(axis) - min(axis) for axis in zip(*outline, strict=True))
    return width, height


def box_middle(outline: Outline) -> Point:
    """Computes the middle of an outline's box."""
    (x1, x2), (y1, y2) = ((min(axis), max(axis)) for axis in zip(*outline, strict=True))
    return (x1 + x2) / 2, (y1 + y2) / 2


class FormulaError(ValueError):
    """Reports a text that is no formula of t."""


def compile_formula(text: str) -> Callable[[float], float]:
    """Compiles a formula of a curve's parameter t: arithmetic and a few functions.

    Raises:
        FormulaError: not a formula, or an unknown name in it. The function raises it too, where it
            has no finite value.
    """
    if len(text) > _LONGEST:
        raise FormulaError(f"longer than {_LONGEST} letters")
    try:
        tree = ast.parse(text.replace("^", "**").strip(), mode="eval").body
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
