"""What the keys of a section mean, as the docstrings of its class and of its bases tell."""

from __future__ import annotations

import inspect
import re

_ATTRIBUTES = re.compile(r"\n*^Attributes:\n", re.MULTILINE)
_KEY = re.compile(r"^    (\w+): (.+(?:\n {8}.+)*)", re.MULTILINE)


def lead(section: type) -> str:
    """What the docstring says before it comes to the attributes, a line for each paragraph."""
    told = _ATTRIBUTES.split(inspect.cleandoc(section.__doc__ or ""))[0]
    return "\n\n".join(map(_on_one_line, told.split("\n\n")))


def meanings(section: type) -> dict[str, str]:
    """The meaning of each attribute, those of the bases first."""
    found: dict[str, str] = {}
    for base in reversed(section.__mro__):
        listed = _ATTRIBUTES.split(inspect.cleandoc(base.__doc__ or ""))[1:]
        found |= {key: _on_one_line(told) for part in listed for key, told in _KEY.findall(part)}
    return found


def _on_one_line(text: str) -> str:
    return " ".join(text.split())
