"""Tells how a method is drawn, the same on every picture."""

from collections.abc import Iterable
from typing import Any, NamedTuple

from matplotlib.lines import Line2D

from reports.base import style

DIFFRAX, SCIPY, NEWTON = "#2f86b4", "#8a5a2b", "#a3304a"


class Mark(NamedTuple):
    """Describes colour and marker; open markers for a second way to solve the same equations."""

    colour: str
    marker: str
    filled: bool = True


_EXPLICIT = style.METHOD_COLOURS["mma"]
MARKS = {
    "ESDIRK3, panels": Mark(style.CLOAKED, "o"),
    "ESDIRK3, fronts": Mark(style.CLOAKED, "o", filled=False),
    "explicit leapfrog": Mark(_EXPLICIT, "s"),
    "explicit Blanes-Moan": Mark(_EXPLICIT, "D"),
    "Newton, by size": Mark(style.METHOD_COLOURS["mma"], "s"),
    "Newton, band": Mark(style.CLOAKED, "o"),
    "Newton, panels": Mark(style.CLOAKED, "D"),
    "Newton, fronts": Mark(style.CLOAKED, "o", filled=False),
    "central differences": Mark(style.CLOAKED, "P"),
    "diffrax Tsit5": Mark(DIFFRAX, "^"),
    "diffrax Dopri5": Mark(DIFFRAX, "v"),
    "diffrax Kvaerno5": Mark(DIFFRAX, "<"),
    "diffrax Tsit5, backsolve": Mark(DIFFRAX, "^", filled=False),
    "pseudo-dynamics, Dopri5": Mark(DIFFRAX, "v"),
    "scipy DOP853": Mark(SCIPY, "^"),
    "scipy Radau": Mark(SCIPY, "s"),
    "scipy BDF": Mark(SCIPY, "D"),
    "Newton, scipy splu": Mark(NEWTON, "s"),
    "scipy newton_krylov": Mark(NEWTON, "X"),
}


def mark(method: str) -> Mark:
    """Returns the mark of a method; grey crosses for one that has none of its own."""
    return MARKS.get(method, Mark(style.GREY, "x"))


def handles(methods: Iterable[str]) -> list[Line2D]:
    """Returns entries of a legend."""
    return [
        Line2D([], [], label=method, linewidth=0.8, markersize=3.5, **drawn(method))
        for method in methods
    ]


def drawn(method: str) -> dict[str, Any]:
    """Returns arguments of a line of that method."""
    colour, marker, filled = mark(method)
    return {"color": colour, "marker": marker, "markerfacecolor": colour if filled else "white"}
