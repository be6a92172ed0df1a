"""Describes values of parameters and their combinations: the section `sweep:`.

A parameter is named by its keys, joined by dots: `drive.frequency`, `material.bending_stiffness`.
Its values are written as they would be at that key, with their unit.
"""

from collections.abc import Mapping
from typing import Annotated, Self

import numpy as np
from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    StrictBool,
    StrictFloat,
    StrictInt,
    StrictStr,
    Tag,
    model_validator,
)

from pipeline.problem.fields import Count, Section, exactly_one, fault, units

SettingValue = StrictStr | StrictBool | StrictInt | StrictFloat
"""A value as a problem file has it."""


def write_quantity(number: float, unit: str) -> SettingValue:
    """Writes a number and its unit ("" for none) as a problem file has them, exactly."""
    return f"{number!r} {unit}" if unit else number


def split_value(word: SettingValue) -> tuple[float, str] | None:
    """Splits a value into number and unit ("" for none); None if it is no number."""
    return None if isinstance(word, bool) else units.split_quantity(str(word))


def _in_one_unit(words: tuple[SettingValue, ...]) -> tuple[SettingValue, ...]:
    found = [split_value(word) for word in words]
    if len({parts and parts[1] for parts in found}) > 1:
        raise fault("the values are given in several units", "give all of them in the same unit")
    return words


def _numbers(first: SettingValue, second: SettingValue) -> tuple[float, float, str]:
    """Splits two quantities in the unit that both are given in."""
    one, two = split_value(first), split_value(second)
    if one is None or two is None:
        raise fault("numbers are wanted here", 'give numbers with their unit, e.g. "2 Hz"')
    _in_one_unit((first, second))
    return one[0], two[0], one[1]


class Range(Section):
    """Equally spaced values.

    Attributes:
        start: the first value.
        stop: the last value, in the same unit.
        points: number of values, both ends included.
    """

    start: SettingValue = Field(alias="from")
    stop: SettingValue = Field(alias="to")
    points: Count

    @model_validator(mode="after")
    def _ascends(self) -> Self:
        first, last, _ = _numbers(self.start, self.stop)
        if self.points > 1 and last <= first:
            raise fault("the values do not ascend", "end above `from`", "to")
        return self

    @property
    def words(self) -> tuple[SettingValue, ...]:
        """Returns the values."""
        first, last, unit = _numbers(self.start, self.stop)
        return tuple(
            write_quantity(float(value), unit) for value in np.linspace(first, last, self.points)
        )


class Between(Section):
    """Any value between two, all equally likely.

    Attributes:
        start: the least value.
        stop: the greatest value, in the same unit.
    """

    start: SettingValue = Field(alias="from")
    stop: SettingValue = Field(alias="to")

    @model_validator(mode="after")
    def _ascends(self) -> Self:
        first, last, _ = _numbers(self.start, self.stop)
        if last <= first:
            raise fault("no value lies between them", "end above `from`", "to")
        return self

    def drawn(self, random: np.random.Generator) -> SettingValue:
        """Draws one value."""
        first, last, unit = _numbers(self.start, self.stop)
        return write_quantity(float(random.uniform(first, last)), unit)


class Normal(Section):
    """Values about a mean, as a normal distribution has them.

    Attributes:
        mean: their mean.
        deviation: their standard deviation, in the same unit.
    """

    mean: SettingValue
    deviation: SettingValue

    @model_validator(mode="after")
    def _of_one_kind(self) -> Self:
        _numbers(self.mean, self.deviation)
        return self

    def drawn(self, random: np.random.Generator) -> SettingValue:
        """Draws one value."""
        mean, deviation, unit = _numbers(self.mean, self.deviation)
        return write_quantity(float(random.normal(mean, abs(deviation))), unit)


def _form(value: object) -> str:
    if not isinstance(value, Mapping | Section):
        return "values"
    return "normal" if {"mean", "deviation"} & set(dict(value)) else "between"


Values = Annotated[tuple[SettingValue, ...], Field(min_length=1), AfterValidator(_in_one_unit)]
Axis = Annotated[
    Annotated[Range, Tag("between")] | Annotated[Values, Tag("values")],
    Discriminator(lambda value: _form(value).replace("normal", "between")),
]
Spread = Annotated[
    Annotated[Between, Tag("between")] | Annotated[Normal, Tag("normal")],
    Discriminator(lambda value: _form(value).replace("values", "between")),
]
Named = Annotated[dict[str, Axis], Field(min_length=1)]


class Sweep(Section):
    """The loss of the altered structure and of the design at many settings; the design stays.

    A parameter is named by its keys, joined by dots, as in `drive.frequency`; its values are
    written as at that key.

    Attributes:
        grid: values of each parameter, of which every combination is taken, the first key fastest.
        list: values of each parameter, taken side by side.
        random: how the values of each parameter spread.
        samples: number of random settings.
        seed: of the random numbers.
    """

    grid: Named | None = None
    list: Named | None = None
    random: Annotated[dict[str, Spread], Field(min_length=1)] | None = None
    samples: Count | None = None
    seed: Annotated[int, Field(ge=0, strict=True)] = 0

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        exactly_one(self, "grid", "list", "random")
        if (self.random is not None) != (self.samples is not None):
            raise fault("`samples` and `random` belong together", "give both or neither")
        if self.list is not None and len(set(map(len, self.values.values()))) > 1:
            raise fault("a list has more values than another", "give as many of each", "list")
        return self

    @property
    def form(self) -> str:
        """Returns the key below which the parameters are."""
        return next(name for name in ("grid", "list", "random") if getattr(self, name) is not None)

    @property
    def keys(self) -> tuple[str, ...]:
        """Returns the names of the parameters."""
        named: Mapping[str, object] = getattr(self, self.form)
        return tuple(named)

    @property
    def values(self) -> dict[str, tuple[SettingValue, ...]]:
        """Returns the values that each parameter takes on a grid or in a list."""
        named = self.grid or self.list or {}
        return {
            key: value.words if isinstance(value, Range) else value for key, value in named.items()
        }
