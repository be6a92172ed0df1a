"""Converts quantities ("15 mm", "6.18 kg/m^2") to floats in the units mm, N, s, tonne, rad.

The registry is our own and small: it loads in a millisecond, and it counts the angle as a dimension
so that degrees cannot be given where a length is wanted, nor a bare number where an angle is.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from pipeline.runtime import UserError

if TYPE_CHECKING:
    from pint import UnitRegistry

_DEFINITIONS = """
micro- = 1e-6 = µ- = \u03bc- = u-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
kilo- = 1e3 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
meter = [length] = m = metre
second = [time] = s = sec
gram = [mass] = g
radian = [angle] = rad
degree = 0.017453292519943295 * radian = deg = °
tonne = 1e6 * gram = t
minute = 60 * second = min
inch = 0.0254 * meter = in = inches
foot = 0.3048 * meter = ft = feet
thou = 2.54e-5 * meter = mil
hertz = 1 / second = Hz
newton = 1000 * gram * meter / second ** 2 = N
gram_force = 9.80665e-3 * newton = gf
pound_force = 4.4482216152605 * newton = lbf
pascal = newton / meter ** 2 = Pa
psi = pound_force / inch ** 2
ksi = 1000 * psi
joule = newton * meter = J
newton_meter = newton * meter = Nm
newton_millimeter = 1e-3 * newton * meter = Nmm
rpm = 1 / minute
"""
KNOWN = (
    "m, in, ft, mil or thou; s, min; g, t; rad, deg or °; Hz, rpm; N, gf, lbf; Pa, psi, ksi;"
    " J, Nm, Nmm; with µ, m, c, k, M, G before them, in products of powers (N mm/rad^2, kg/m²)"
)
"""The units that quantities are given in, in words."""

_LONGEST = 80
_GREATEST = 1e12
"""In working units."""
_NUMBER = r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
# Only products of integer powers go to pint, whose own grammar would evaluate any arithmetic.
_POWER = r"[A-Za-z\u00b5\u03bc°]+(?:(?:\^|\*\*)-?\d)?"
_UNIT = rf"(?P<unit>{_POWER}(?:\s*[*·/ ]\s*{_POWER})*)"
_QUANTITY = re.compile(rf"\s*{_NUMBER}\s*(?:{_UNIT}|(?P<rest>\S.*?))?\s*")
_MISSPELT = re.compile(
    r"(?<![A-Za-z\u00b5\u03bc])(?:[MG](?:m|s|sec|rad|deg)|mPa)(?![A-Za-z])"
    r"|(?<![A-Za-z/])[MG]N(?![A-Za-z]|\s*/|.*-)"
)
"""Units that nobody in this field measures in, of which another spelling is one: mm, mN, MPa.

Meganewtons are told in stiffnesses and moduli alone.
"""
_WORD = re.compile(r"(?<![A-Za-z])[MG](?:in|ft|mil|min)(?![A-Za-z])")
"""Words, such as the Min of a column's title, that would be millions of inches or minutes."""
_COMMA = re.compile(r"\s*[+-]?\d+,\d")
_MINUS = re.compile(r"\s*(?P<sign>[\u2212\u2013])\s*[\d.]")
_SIGNS = {"\u2212": "the minus sign is U+2212", "\u2013": "the minus sign is an en dash, U+2013"}
_PERCENT = re.compile(rf"\s*{_NUMBER}\s*%\s*")
_RAISED = str.maketrans({"²": "^2", "³": "^3"})


@dataclass(frozen=True, slots=True)
class Dimension:
    """Describes a kind of quantity: its name, working unit, units of equal right, an example."""

    name: str
    unit: str
    example: str
    also: tuple[str, ...] = ()


class MisspeltUnitError(UserError):
    """Reports a unit that is most likely another one, its letters in the wrong case."""


LENGTH = Dimension("a length", "mm", "15 mm")
ANGLE = Dimension("an angle", "rad", "20 deg")
TIME = Dimension("a time", "s", "0.5 s")
FREQUENCY = Dimension("a frequency", "Hz", "2 Hz")
AREAL_DENSITY = Dimension("a mass per area", "tonne/mm^2", "6.18 kg/m^2")
FORCE = Dimension("a force", "N", "0.02 N")
MOMENT = Dimension("a moment", "N mm", "20 N mm", ("N mm/rad",))
STIFFNESS = Dimension("a stiffness", "N/mm", "120 N/mm")
BENDING_STIFFNESS = Dimension("a bending stiffness", "N mm/rad", "1.5 N mm/rad", ("N mm",))
CONTACT_STIFFNESS = Dimension("a contact stiffness", "N mm/rad^2", "1.5 N mm/rad^2", ("N mm",))
MODULUS = Dimension("a modulus of elasticity", "N/mm^2", "4500 MPa")
DAMPING = Dimension("a damping", "tonne/s", "2.876e-2 kg/s")
ROTARY_DAMPING = Dimension(
    "a rotary damping", "tonne mm^2/s/rad", "1.2e-7 kg m^2/s", ("tonne mm^2/s",)
)


@lru_cache(maxsize=1)
def _registry() -> UnitRegistry:
    from pint import UnitRegistry

    return UnitRegistry(_DEFINITIONS.strip().splitlines())


def _matched(text: str) -> re.Match[str] | None:
    return None if len(text) > _LONGEST else _QUANTITY.fullmatch(text.translate(_RAISED))


def split_quantity(text: str) -> tuple[float, str] | None:
    """Splits a quantity into number and unit ("" for none); None if the text is none."""
    match = _matched(text)
    return None if match is None or match["rest"] else (float(match["number"]), match["unit"] or "")


def misspelt_number(text: str) -> tuple[str, str] | None:
    """Finds what is wrong with how a number is written, and the remedy; None if that is unknown."""
    if found := _MINUS.match(text):
        return _SIGNS[found["sign"]], "write -"
    return ("a decimal comma", "write a decimal point") if _COMMA.match(text) else None


def misspelt_share(text: str) -> tuple[str, str] | None:
    """Finds a number in percent where a plain one is wanted, and that number as the remedy."""
    found = _PERCENT.fullmatch(text[:_LONGEST])
    return found and ("a number in percent", f"write {float(found['number']) / 100:.12g}")


def parse_quantity(text: object, dimension: Dimension) -> float:
    """Converts the quantity `text` to a float in the working unit of `dimension`.

    Raises:
        UserError: no unit, an unknown one, one of another dimension or that nobody uses, or a
            number that is not finite or beyond all that is built.
    """
    wanted = f'{dimension.name} is wanted here, e.g. "{dimension.example}"'
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise UserError("not a quantity", remedy=wanted)
    if slip := misspelt_number(str(text)):
        raise UserError(slip[0], remedy=f"{slip[1]}; {wanted}")
    match = _matched(str(text))
    if match is None:
        raise UserError("not a number with a unit", remedy=wanted)
    if match["rest"] is not None:
        raise UserError(f"unknown unit {match['rest']!r}", remedy=f"{wanted}; known are {KNOWN}")
    if match["unit"] is None:
        raise UserError("the unit is missing", remedy=wanted)
    factor = _factor(match["unit"], dimension, wanted)
    if found := _MISSPELT.search(match["unit"]):
        what = f"nobody measures {dimension.name} in {match['unit']!r}"
        remedy = f"mind capitals: M is a million, m a thousandth; write {_meant(found[0])} if meant"
        raise MisspeltUnitError(what, remedy=f"{remedy}, else convert; {wanted}")
    value = float(match["number"]) * factor
    if not math.isfinite(value):
        raise UserError("not a finite number", remedy=wanted)
    if abs(value) > _GREATEST:
        what = f"no specimen has {value:.3g} {dimension.unit}"
        raise UserError(what, remedy=f"check number and unit; {wanted}")
    return value


def _meant(unit: str) -> str:
    """Spells a unit of a wrong prefix with the one that its letter is mistaken for."""
    return f"M{unit[1:]}" if unit == "mPa" else f"m{unit[1:]}"


@lru_cache
def _factor(unit: str, dimension: Dimension, wanted: str) -> float:
    from pint.errors import UndefinedUnitError

    registry = _registry()
    try:
        if _WORD.search(unit):
            raise KeyError(unit)
        given = registry.Quantity(1.0, registry.parse_units(unit))
    except (UndefinedUnitError, KeyError, ValueError) as error:  # a zeroth power, a number
        raise UserError(f"unknown unit {unit!r}", remedy=f"{wanted}; known are {KNOWN}") from error
    for accepted in (dimension.unit, *dimension.also):
        if given.is_compatible_with(accepted):
            return float(given.to(accepted).magnitude)
    raise UserError(f"the unit {unit!r} is not that of {dimension.name}", remedy=wanted)
