"""Renders HTML from templates; text is escaped, what is not given is an error."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup, escape

from pipeline.runtime import BUILD

_TEMPLATES = Path(__file__).parent / "templates"


def rendered(template: str, values: Mapping[str, Any]) -> str:
    """Returns HTML of a template, by the name of its file."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )
    environment.filters["groupby_order"] = _in_order
    environment.filters["symbols"] = _symbols
    environment.globals["build"] = BUILD
    return environment.get_template(template).render(values)


def inlined(svg: str) -> str:
    """Returns the element of an SVG file, coordinates to 0.001 pt."""
    return re.sub(r"(\d\.\d{3})\d+", r"\1", element(svg))


def element(svg: str) -> str:
    """Returns the element of an SVG file without prologue and metadata."""
    return re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)


def _symbols(text: str) -> Markup:
    return Markup(re.sub(r"\bu_([xy])\b", r"u<sub>\1</sub>", str(escape(text))))


def _in_order(items: Iterable[Any], attribute: str) -> list[dict[str, object]]:
    """Returns items grouped by an attribute, groups in the order of their first member."""
    groups: dict[str, list[Any]] = {}
    for item in items:
        groups.setdefault(getattr(item, attribute), []).append(item)
    return [{"name": name, "members": members} for name, members in groups.items()]
