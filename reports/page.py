"""The page of a report: one HTML file that works from disk, without a network."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jinja2
import xarray as xr
from markupsafe import Markup, escape

from reports.facts import ABSENT, Fact
from reports.tables import Table

LARGEST_PAGE = 6_000_000
"""Bytes that a page may have."""

_TEMPLATES = Path(__file__).parent / "templates"


@dataclass(frozen=True)
class Page:
    """What a page shows.

    `caption` is HTML; `player` is reports.player's payload; `targets` build the studies shown.
    """

    title: str
    targets: Sequence[str]
    lead: str
    credit: str
    figure_title: str
    caption: str
    svg: str
    figure_files: Sequence[str]
    headline: Sequence[Fact]
    facts: Sequence[Fact]
    tables: Sequence[Table]
    player: Mapping[str, Any]
    player_note: str
    provenance: Sequence[Source]
    problem: str
    skipped: Sequence[str]
    draft: Sequence[str] = field(default_factory=tuple)


@dataclass(frozen=True)
class Source:
    """Where a part of the page is from: a dataset and its attributes."""

    name: str
    entries: Sequence[tuple[str, str]]


def source(name: str, data: xr.Dataset) -> Source:
    """Attributes of a dataset, except the problem, which the page shows once."""
    kept = {str(key): value for key, value in data.attrs.items() if key != "problem"}
    return Source(name, [entry for key in sorted(kept) for entry in _entries(key, kept[key])])


def _entries(key: str, value: object) -> list[tuple[str, str]]:
    """An attribute as lines of text; JSON in it is unfolded, one line a leaf or a list."""
    if isinstance(value, str) and value.startswith(("{", "[")):
        value = json.loads(value)
    if isinstance(value, dict):
        return [line for name in sorted(value) for line in _entries(f"{key}: {name}", value[name])]
    items = value if isinstance(value, list) else [value]
    return [(key, "; ".join(str(item) for item in items))]


def render(page: Page) -> str:
    """HTML of the page."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )
    environment.filters["groupby_order"] = _in_order
    environment.filters["symbols"] = _symbols
    values = dict(vars(page))
    values["quotes"] = any(fact.paper != ABSENT for fact in page.facts)
    values["tables"] = [_link(table) for table in page.tables]
    values["svg"] = _inline(page.svg)
    # "</" would end the script element that holds the data.
    values["player"] = json.dumps(page.player, ensure_ascii=False).replace("</", "<\\/")
    return environment.get_template("page.html.j2").render(values)


def _link(table: Table) -> dict[str, object]:
    return {
        "name": table.name,
        "text": table.text,
        "rows": table.n_rows,
        "base64": base64.b64encode(table.csv).decode("ascii"),
    }


def _inline(svg: str) -> str:
    """The SVG element without prologue and metadata, with coordinates to 0.001 pt."""
    element = svg[svg.index("<svg") :]
    element = re.sub(r"<metadata>.*?</metadata>", "", element, flags=re.DOTALL)
    return re.sub(r"(\d\.\d{3})\d+", r"\1", element)


def _symbols(text: str) -> Markup:
    """Escaped text in which u_y has its index."""
    return Markup(re.sub(r"\bu_([xy])\b", r"u<sub>\1</sub>", str(escape(text))))


def _in_order(items: Iterable[Fact], attribute: str) -> list[dict[str, object]]:
    """Items grouped by an attribute, groups in the order of their first member."""
    groups: dict[str, list[Fact]] = {}
    for item in items:
        groups.setdefault(getattr(item, attribute), []).append(item)
    return [{"name": name, "members": members} for name, members in groups.items()]
