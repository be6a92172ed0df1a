"""Writes the JSON schema of problem files, for editors that complete and check."""

import argparse
import json
from pathlib import Path
from typing import Any

from pipeline.problem import Problem

DEFAULT = Path("experiments/problem.schema.json")
_OVERLAY = "Overlay"


def schema() -> dict[str, Any]:
    """Builds the schema of a problem file, presets included."""
    whole = _without_working_units(Problem.model_json_schema(mode="validation"))
    sections = whole.pop("$defs")
    for section in (whole, sections["TestSetup"]):
        _offer_drives(section, sections)
    overlay = _overlaid({key: value for key, value in whole.items() if key != "title"})
    overlays = {name + _OVERLAY: _overlaid(section) for name, section in sections.items()}
    whole["properties"]["presets"] = {
        "description": "keys laid over those above: mappings merge, others replace, null removes",
        "type": "object",
        "additionalProperties": {"$ref": f"#/$defs/Problem{_OVERLAY}"},
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **whole,
        "$defs": {**sections, **overlays, f"Problem{_OVERLAY}": overlay},
    }


def _offer_drives(whole: dict[str, Any], sections: dict[str, Any]) -> None:
    """Adds `drives`, a list that stands for a drive of the kind `several`."""
    told = {"description": "what moves it at once, instead of `drive`"}
    whole["properties"]["drives"] = sections["SeveralDrives"]["properties"]["drives"] | told
    whole["required"].remove("drive")
    whole["oneOf"] = [{"required": ["drive"]}, {"required": ["drives"]}]


def text() -> str:
    """Formats the schema as it is committed."""
    return json.dumps(schema(), indent=2, sort_keys=True, ensure_ascii=False) + "\n"


def _without_working_units(node: Any) -> Any:  # noqa: ANN401  (any JSON)
    """Drops defaults of quantities: floats in working units, which a file may not hold."""
    if isinstance(node, list):
        return [_without_working_units(item) for item in node]
    if not isinstance(node, dict):
        return node
    hidden = "default" if node.get("type") == "string" and "examples" in node else None
    return {key: _without_working_units(value) for key, value in node.items() if key != hidden}


def _overlaid(node: Any) -> Any:  # noqa: ANN401  (any JSON)
    """Builds the schema of a part of `node`: nothing is required, null removes a key."""
    if isinstance(node, list):
        return [_overlaid(item) for item in node]
    if not isinstance(node, dict):
        return f"{node}{_OVERLAY}" if str(node).startswith("#/$defs/") else node
    part = {key: _overlaid(value) for key, value in node.items() if key not in _STRICT}
    if "oneOf" in part:  # parts of several kinds of drive look alike
        part["anyOf"] = part.pop("oneOf")
    if part.get("additionalProperties") is False:  # of another kind, whose keys it removes
        part["additionalProperties"] = {"type": "null"}
    if isinstance(properties := part.get("properties"), dict):
        part["properties"] = {
            key: {"anyOf": [value, {"type": "null"}]} for key, value in properties.items()
        }
    return part


_STRICT = ("required", "discriminator", "default")


def work(args: argparse.Namespace) -> None:
    """Writes the schema."""
    args.out.write_text(text(), encoding="utf-8")
