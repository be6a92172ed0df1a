"""A page of one figure with its tables, for products of a study beside its report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from reports.base import Table, style
from reports.page import publishing, templating


@dataclass(frozen=True)
class PageTable:
    """A table on the page itself.

    Attributes:
        columns: its headings.
        rows: its cells as text.
    """

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class FigurePage:
    """What the page tells.

    Attributes:
        name: of the figure's files.
        title: of the study.
        subject: what of the study.
        lead: the page's first line.
        caption: of the figure.
        figure: makes it.
        tables: written as CSV beside the page.
        sources: attributes of the dataset.
        datasets: addresses of what is shown, as seen from the page.
        shown: the table on the page, if there is one.
        draft: why this is but a draft, if it is one.
    """

    name: str
    title: str
    subject: str
    lead: str
    caption: str
    figure: Callable[[], Figure]
    tables: Sequence[Table]
    sources: Mapping[str, object]
    datasets: Sequence[str]
    shown: PageTable | None = None
    draft: Sequence[str] = ()


def publish_figure_page(sheet: FigurePage, folder: Path) -> list[Path]:
    """Make figure, tables and page aside and move them into `folder`, the page last.

    Raises:
        UserError: the folder is full, read-only or not ours.
    """
    return publishing.published(lambda aside: _write(sheet, aside), folder)


def _write(sheet: FigurePage, folder: Path) -> list[Path]:
    with style.styled():
        drawn = style.save(sheet.figure(), folder / sheet.name)
    for table in sheet.tables:
        (folder / table.name).write_bytes(table.csv)
    svg = (folder / f"{sheet.name}.svg").read_text(encoding="utf-8")
    values = {
        **{name: getattr(sheet, name) for name in _TOLD},
        "svg": templating.inlined(svg),
        "files": [path.name for path in drawn],
        "sources": sorted((key, str(value)) for key, value in sheet.sources.items()),
    }
    page = folder / "index.html"
    text = templating.rendered("sheet.html.j2", values)
    page.write_text(text, encoding="utf-8", newline="\n")
    return [*drawn, *(folder / table.name for table in sheet.tables), page]


_TOLD = ("title", "subject", "lead", "caption", "tables", "datasets", "shown", "draft")
