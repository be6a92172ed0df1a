"""Composes a figure of lettered panels, each with its sentence of the caption and its tables."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

from matplotlib.figure import Figure

from reports.base import Table, style
from reports.study import draft


@dataclass(frozen=True)
class Panel:
    """Describes a part of a figure."""

    head: tuple[str, str, float, float]  # letter, title, and their place: mm from left and top
    draw: Callable[[Figure], object] | None = None  # below its letter; none if another one does
    caption: str = ""  # its sentence, as HTML
    tables: Sequence[Table] = ()  # what it shows


@dataclass(frozen=True)
class PanelFigure:
    """Describes a figure of two columns' width: its height in mm, and its panels.

    `draft` tells why it is but a draft, if it is one; `remark` ends the caption.
    """

    height: float
    panels: Sequence[Panel]
    draft: Sequence[str] = ()
    remark: str = ""

    def draw(self) -> Figure:
        """Draws all panels."""
        figure = style.page(self.height)
        for panel in self.panels:
            letter, title, left, top = panel.head
            style.letter(figure, left, top, letter, title)
            if panel.draw is not None:
                panel.draw(figure)
        if self.draft:
            draft.mark(figure)
        return figure

    @cached_property
    def caption(self) -> str:
        """Returns the sentences of the panels, as HTML."""
        told = [f"<b>{each.head[0]}</b> {each.caption}" for each in self.panels if each.caption]
        return " ".join(told) + self.remark

    @cached_property
    def tables(self) -> list[Table]:
        """Returns the tables of the panels, in their order."""
        return [table for panel in self.panels for table in panel.tables]
