"""Writes the page on the public names of sim, from their signatures and docstrings."""

import inspect
import re
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from types import FunctionType
from typing import Any

import sim
from pipeline.workflow.reference.markdown import head, table

ROOMS = {
    "structure": "Structures",
    "solvers": "Loads",
    "scene": "Scenes, responses and designs",
    "constraints": "What can be made",
    "optimise": "Options of the optimisers",
    "energy": "Energies and forces",
    "vibration": "Vibrations and waves",
    "core": "Errors",
}
_MEMBERS = (FunctionType, property, cached_property)
_NAME = re.compile(r"^from \.(\w+) import (\w+) as \2$", re.MULTILINE)
_SECTION = re.compile(r"^(Args|Attributes|Returns|Raises):$")


def page() -> str:
    """The page, in Markdown."""
    stub = Path(str(sim.__file__)).with_suffix(".pyi").read_text(encoding="utf-8")
    rooms: dict[str, list[str]] = {}
    for room, name in _NAME.findall(stub):
        rooms.setdefault(room, []).append(name)
    parts = [head(__file__)]
    for room, title in ROOMS.items():
        names = {name: getattr(sim, name) for name in sorted(rooms.pop(room), key=str.lower)}
        rows = ((f"[`{name}`](#{name.lower()})", _opening(found)) for name, found in names.items())
        parts += [f"\n## {title}\n\n", table(("name", "what it does"), rows)]
        parts += [_entry(name, found) for name, found in names.items()]
    assert not rooms, f"rooms without a title: {', '.join(rooms)}"
    return "".join(parts)


def _opening(found: Any) -> str:  # noqa: ANN401
    """First paragraph of a docstring, in one line."""
    return " ".join((inspect.getdoc(found) or "").split("\n\n")[0].split())


def _entry(name: str, found: Any) -> str:  # noqa: ANN401
    """Heading, signature, docstring, and a class's own properties and methods."""
    lines = [f"\n### {name}\n\n```python\n{_signature(name, found)}\n```\n\n"]
    lines += _prose(inspect.getdoc(found) or "")
    members = [
        f"- `{key}`: {_opening(member)}\n"
        for key, member in (vars(found).items() if inspect.isclass(found) else ())
        if not key.startswith("_") and isinstance(member, _MEMBERS)
    ]
    return "".join([*lines, *(["\n", *members] if members else [])])


def _signature(name: str, found: Any) -> str:  # noqa: ANN401
    words = []
    for each in inspect.signature(found).parameters.values():
        prefix = "*" * (each.kind is each.VAR_POSITIONAL) + "**" * (each.kind is each.VAR_KEYWORD)
        default = "" if each.default is each.empty else f"={_default(each.default)}"
        words.append(prefix + each.name + default)
    return f"{name}({', '.join(words)})"


def _default(value: object) -> str:
    text = repr(value)
    return text if isinstance(value, str | int | float | tuple | None) and len(text) < 30 else "..."


def _prose(text: str) -> Iterator[str]:
    """Paragraphs as they are; the entries of sections as items of a list."""
    listed = False
    for line in text.splitlines():
        if found := _SECTION.match(line):
            listed = True
            yield f"{found[1]}:\n\n"
        elif listed and line.startswith("    ") and not line.startswith("     "):
            name, _, meaning = line.strip().partition(": ")
            yield f"- `{name}`: {meaning}\n" if meaning else f"- {name}\n"
        else:
            yield f"  {line.strip()}\n" if listed and line else f"{line}\n"
    yield "\n" if listed else ""
