"""Lists the cases of a sweep with their settings."""

import copy
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice, product
from typing import Any

import numpy as np

from pipeline.problem.sections.sweep import SettingValue, Sweep, split_value

Setting = Mapping[str, SettingValue | list[SettingValue]]
"""Values by the dotted keys that they are set at."""

DIRECTIONS = "drive.directions"


def case_count(sweep: Sweep) -> int:
    """Counts the cases."""
    if sweep.samples is not None:
        return sweep.samples
    sizes = [len(values) for values in sweep.values.values()]
    return math.prod(sizes) if sweep.grid is not None else sizes[0]


def list_settings(sweep: Sweep) -> Iterator[dict[str, SettingValue]]:
    """Lists the settings of the cases, one after the other."""
    if sweep.random is not None:
        yield from (_drawn(sweep, number) for number in range(case_count(sweep)))
    elif sweep.list is not None:
        for values in zip(*sweep.values.values(), strict=True):
            yield dict(zip(sweep.keys, values, strict=True))
    else:
        for values in product(*reversed(sweep.values.values())):  # the last one varies fastest
            yield dict(zip(sweep.keys, reversed(values), strict=True))


def _drawn(sweep: Sweep, number: int) -> dict[str, SettingValue]:
    """Draws a random case: the same whatever other cases there are."""
    assert sweep.random is not None
    random = np.random.default_rng((sweep.seed, number))
    return {key: spread.drawn(random) for key, spread in sweep.random.items()}


@dataclass(frozen=True)
class DirectionGroup:
    """Groups cases one after the other that differ by the direction of their drive alone.

    They are load cases of one scene: what is a copy of another, turned, is not simulated.
    """

    numbers: range
    settings: tuple[dict[str, SettingValue], ...]

    @property
    def cases(self) -> list[tuple[int, dict[str, SettingValue]]]:
        """Number and setting of each."""
        return list(zip(self.numbers, self.settings, strict=True))

    @property
    def together(self) -> Setting:
        """One setting with the directions of all."""
        first, *others = self.settings
        if DIRECTIONS not in first:
            return first
        return first | {DIRECTIONS: [each[DIRECTIONS] for each in (first, *others)]}


def group_size(sweep: Sweep) -> int:
    """Counts cases in each group: directions are grouped where a grid names them first."""
    grouped = sweep.grid is not None and sweep.keys[0] == DIRECTIONS
    return len(sweep.values[DIRECTIONS]) if grouped else 1


def group_count(sweep: Sweep) -> int:
    """Counts the groups of cases."""
    return case_count(sweep) // group_size(sweep)


def select_groups(sweep: Sweep, number: int, parts: int) -> list[DirectionGroup]:
    """Selects the groups of one of several parts of a sweep, none empty or much larger."""
    size, total = group_size(sweep), group_count(sweep)
    first, last = (size * (total * (number + edge) // parts) for edge in (0, 1))
    cases = islice(list_settings(sweep), first, last)
    return [
        DirectionGroup(range(start, start + size), tuple(islice(cases, size)))
        for start in range(first, last, size)
    ]


def parameter_unit(sweep: Sweep, key: str) -> str:
    """Finds the unit of a parameter's values; "1" for plain numbers and for words."""
    first = split_value(next(islice(list_settings(sweep), 1))[key])
    return (first and first[1]) or "1"


class SettingError(ValueError):
    """Refuses a key that leads to nothing a value could be set at."""


def apply_setting(data: Mapping[str, Any], setting: Setting) -> dict[str, Any]:
    """Lays a setting over the content of a problem file, as read or in its canonical form.

    A single value at a key that holds a list is a list of one, and items of lists are named by
    their number from 0: `drives.0.amplitude`. New directions weigh equally.

    Raises:
        SettingError: there is no section above a key.
    """
    made = copy.deepcopy(dict(data))
    for key, value in setting.items():
        *above, last = _canonical(key, made).split(".")
        section = _section(made, above, key)
        if last in _DIRECTIONS and _is_drive(above):
            for name in (*_DIRECTIONS, "weights"):
                section.pop(name, None)
            section["directions"] = value if isinstance(value, list) else [value]
        else:
            several = isinstance(section.get(last), list) and not isinstance(value, list)
            section[last] = [value] if several else value
    return made


def names_directions(setting: Setting) -> bool:
    """Tells whether a setting gives the drive's directions, each a load case of its own."""
    return not {f"drive.{name}" for name in _DIRECTIONS}.isdisjoint(setting)


_DIRECTIONS = ("directions", "direction")
"""The key of a drive's directions, and that of a single one, which stands for a list of one."""


def _is_drive(names: list[str]) -> bool:
    return names[-1:] == ["drive"] or names[-2:-1] == ["drives"]


def _canonical(key: str, data: Mapping[str, Any]) -> str:
    """Names a key below several drives as the canonical form has it, where that is given."""
    several = key.startswith("drives.") and "drives" not in data and "drive" in data
    return f"drive.{key}" if several else key


def _section(data: dict[str, Any], above: list[str], key: str) -> dict[str, Any]:
    """Finds the section that holds a key, and makes those that a file leaves out."""
    section: Any = data
    for name in above:
        if isinstance(section, list):
            if not name.isdigit() or int(name) >= len(section):
                raise SettingError(f"{key}: {name!r} is no item of a list of {len(section)}")
            section = section[int(name)]
        else:
            section = section.setdefault(name, {})
        if not isinstance(section, dict | list):
            raise SettingError(f"{key}: {name!r} holds a value, and no keys")
    if isinstance(section, list):
        sections = any(isinstance(item, dict) for item in section)
        how = "name an item by its number from 0" if sections else "give all of its values at once"
        raise SettingError(f"{key}: {above[-1]!r} holds a list; {how}")
    return section
