"""Lays out a page of one figure with its tables, for products of a study beside its report."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import xarray as xr
from matplotlib.figure import Figure

from pipeline.problem import Problem
from reports.base import Table
from reports.page.report import Report


@dataclass(frozen=True)
class PageTable:
    """Holds a table on the page itself: its headings, and its cells as text."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


class FigureText(NamedTuple):
    """Holds what a page of one figure says: its `subject` is what of the study it shows."""

    title: str
    subject: str
    lead: str
    caption: str


def titled(problem: Problem, path: Path) -> str:
    """Returns the title of a problem; the folder of its file names one without."""
    return problem.title or path.resolve().parent.name


def figure_page(
    name: str,
    text: FigureText,
    figure: Callable[[], Figure],
    tables: Sequence[Table],
    data: xr.Dataset,
    *,
    shown: PageTable | None = None,
    draft: Sequence[str] = (),
    parents: Sequence[str] = (),
) -> Report:
    """Returns the report of a dataset, whose name the figure's files bear too.

    `shown` is the table on the page, if there is one; `draft` tells why this is but a draft, if it
    is one; `parents` are other datasets of the study that it came from.
    """
    values = {
        **text._asdict(),
        "datasets": [f"../{each}.nc" for each in (name, *parents)],
        "shown": shown,
        "draft": draft,
        "sources": sorted((key, str(value)) for key, value in data.attrs.items()),
    }
    return Report({name: figure}, "sheet.html.j2", values, tables)
