"""Writes the pages on the YAML files: every key with its type, its default and its meaning."""

import json
import math
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from pipeline.calibration.inputs import Calibration, KnownPictures, LoadCycles, Population
from pipeline.problem import Problem
from pipeline.problem.fields import Section, units
from pipeline.problem.reading import JointFigure
from pipeline.tracking.frames import Recording
from pipeline.tracking.output import DicExport
from pipeline.workflow.reference.markdown import head, table

Node = dict[str, Any]

PRESETS = """
`presets` holds variants by name. Each has keys that are laid over those of the file: mappings
merge, lists and values replace, `null` removes, or turns off what is on by default.
`make fig2@edge3` builds one.
"""
_DIMENSIONS = {
    each.example: each for each in vars(units).values() if isinstance(each, units.Dimension)
}
_BOUNDS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
_PLAIN = {
    "string": "text",
    "integer": "whole number",
    "number": "number",
    "boolean": "`true` or `false`",
}


class File(NamedTuple):
    """Describes a YAML file: its name, the model that checks it, where it is, and more about it."""

    name: str
    model: type[Section]
    place: str
    more: str = ""


def pages() -> dict[str, str]:
    """Writes the pages, in Markdown, by the names of their files."""
    studies = (
        File("problem.yaml", Problem, "`experiments/STUDY/problem.yaml`", PRESETS),
        File("figure.yaml", JointFigure, "`experiments/FIGURE/figure.yaml`"),
    )
    recordings = (
        File("A recording", Recording, "`experiments/STUDY/recordings/NAME.yaml`"),
        File("Points", DicExport, "In place of a video, for `python -m pipeline track points`"),
    )
    calibrations = (
        File("A calibration", Calibration, "`experiments/calibration/NAME.yaml`"),
        File("Several samples", Population, "For `python -m pipeline validate samples`"),
        File("Load cycles", LoadCycles, "For `python -m pipeline validate cycles`"),
        File("Pictures", KnownPictures, "For `python -m pipeline validate pictures`"),
    )
    return {
        "keys.md": _page("problem files", studies),
        "keys_recordings.md": _page("recordings", recordings),
        "keys_calibrations.md": _page("calibrations", calibrations),
    }


def _page(title: str, files: tuple[File, ...]) -> str:
    told: set[str] = set()
    parts = [head(__file__, title=title, units=units.KNOWN)]
    for file in files:
        schema = file.model.model_json_schema(mode="validation")
        lead = f"{file.place}. {schema['description']}"
        parts += [f"\n## {file.name}\n\n{lead}\n{file.more}\n", _keys(schema)]
        parts += _sections(schema, told)
    return "".join(parts)


def _sections(schema: Node, told: set[str]) -> Iterator[str]:
    """Walks over the sections that a file may have, in the order in which the keys name them."""
    sections: dict[str, Node] = schema.get("$defs", {})
    waiting = _named(schema["properties"])
    while waiting:
        name = waiting.pop(0)
        if name not in told:
            told.add(name)
            section = sections[name]
            yield f"\n### {_heading(name)}\n\n{section['description']}\n\n{_keys(section)}"
            waiting = [*_named(section["properties"]), *waiting]


def _named(node: object) -> list[str]:
    """Lists the sections that a schema refers to, in order."""
    return re.findall(r'"#/\$defs/(\w+)"', json.dumps(node))


def _heading(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).capitalize()


def _keys(section: Node) -> str:
    needed = section.get("required", [])
    rows = [
        (
            f"`{key}`",
            kind(node),
            "" if key in needed else _default(node.get("default"), node),
            node.get("description") or ("tells the form" if "const" in node else ""),
        )
        for key, node in section["properties"].items()
    ]
    return table(("key", "type", "default", "meaning"), rows)


def kind(node: Node) -> str:
    """Tells in words what may be given."""
    if "$ref" in node:
        heading = _heading(node["$ref"].rpartition("/")[2])
        return f"[{heading}](#{heading.lower().replace(' ', '-')})"
    if forms := node.get("anyOf") or node.get("oneOf"):
        return " or ".join(kind(form) for form in forms if form.get("type") != "null")
    if choices := node.get("enum") or [node[key] for key in ("const",) if key in node]:
        return ", ".join(f"`{choice}`" for choice in choices)
    if node["type"] == "array":
        return _list(node)
    if node["type"] == "object":
        return f"mapping to {kind(node['additionalProperties'])}"
    return _scalar(node)


def _scalar(node: Node) -> str:
    if (dimension := _dimension(node)) is not None:
        unit = dimension.example.split(maxsplit=1)[1]
        return f"{dimension.name.split(maxsplit=1)[1]} (`{unit}`)"
    bounds = [f"{sign} {node[bound]:g}" for bound, sign in _BOUNDS.items() if bound in node]
    return " ".join([_PLAIN[node["type"]], ", ".join(bounds)]).strip()


def _list(node: Node) -> str:
    if "prefixItems" not in node:
        return f"list of {kind(node['items'])}"
    kinds = [kind(item) for item in node["prefixItems"]]
    return f"pair, each {kinds[0]}" if len(set(kinds)) == 1 else f"[{', '.join(kinds)}]"


def _dimension(node: Node) -> units.Dimension | None:
    examples = node.get("examples", [None])
    return _DIMENSIONS.get(examples[0])


def _default(value: object, node: Node) -> str:
    """Formats the default as it would be written in the file."""
    if value is None or value in ("", {}, []):
        return "none"
    if isinstance(value, dict):
        return "see there" if len(value) > 1 else _mapping(value)
    return f"`{_written(value, node)}`"


def _mapping(value: Node) -> str:
    return "`" + ", ".join(f"{key}: {item}" for key, item in value.items()) + "`"


def _written(value: object, node: Node) -> str:
    if isinstance(value, list):
        items = node.get("prefixItems") or [node["items"]] * len(value)
        return f"[{', '.join(_written(*pair) for pair in zip(value, items, strict=True))}]"
    forms = [form for form in node.get("anyOf", ()) if form.get("type") != "null"]
    dimension = _dimension(forms[0] if forms else node)
    if dimension is None or not isinstance(value, float):
        return json.dumps(value) if isinstance(value, bool) else f"{value}"
    if dimension is units.ANGLE:
        return f"{math.degrees(value):g} deg"
    return f"{value:g} {dimension.unit}"
