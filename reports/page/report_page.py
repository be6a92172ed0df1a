"""The page of a report: one HTML file that works from disk, without a network."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import xarray as xr

from pipeline.workflow import showing
from reports.base import Table
from reports.facts import ABSENT, Fact, JudgedClaim, claims
from reports.page import citation, templating
from reports.study import LABEL, RecordedMotion

LARGEST_PAGE = 6_000_000
"""Bytes that a page may have."""


@dataclass(frozen=True)
class ReportPage:
    """What a page shows.

    `caption` is HTML; `player` is reports.panels.animation_data's payload; `targets` build the
    studies shown;
    `datasets` are addresses of theirs, as seen from the page; `claims` are the paper's on them.
    """

    title: str
    targets: Sequence[str]
    lead: str
    credit: str
    figure_title: str
    caption: str
    svg: str
    figure_files: Sequence[str]
    datasets: Sequence[str]
    headline: Sequence[Fact]
    facts: Sequence[Fact]
    tables: Sequence[Table]
    player: Mapping[str, Any]
    player_note: str
    provenance: Sequence[Source]
    problem: str
    skipped: Sequence[str]
    draft: Sequence[str] = field(default_factory=tuple)
    claims: Sequence[JudgedClaim] = field(default_factory=tuple)
    recordings: Sequence[RecordedMotion] = field(default_factory=tuple)


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


def render(page: ReportPage) -> str:
    """HTML of the page."""
    values = dict(vars(page))
    values["quotes"] = any(fact.paper != ABSENT for fact in page.facts)
    values["synthetic"] = LABEL if any(each.synthetic for each in page.recordings) else ""
    values["movies"] = showing(page.targets)
    values["tables"] = [_link(table) for table in page.tables]
    values["svg"] = templating.inlined(page.svg)
    values["verdict"] = claims.verdict(page.claims)
    values["citations"] = citation.citations()
    # "</" would end the script element that holds the data.
    values["player"] = json.dumps(page.player, ensure_ascii=False).replace("</", "<\\/")
    return templating.rendered("page.html.j2", values)


def _link(table: Table) -> dict[str, object]:
    return {
        "name": table.name,
        "text": table.text,
        "rows": table.n_rows,
        "base64": base64.b64encode(table.csv).decode("ascii"),
    }
