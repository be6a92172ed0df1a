"""Which report a study gets, by what its problem asks for and not by its name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from matplotlib.figure import Figure

from pipeline.problem import Problem
from pipeline.problem.drives import Harmonic, RampHarmonic
from reports.facts import Fact
from reports.page import Page
from reports.study import Study
from reports.tables import Table


class Kind(Protocol):
    """The parts of a report, each made from a study; the page comes last, from all the others."""

    def facts(self, study: Study) -> list[Fact]:
        """Numbers computed from the datasets."""
        ...

    def tables(self, study: Study) -> list[Table]:
        """What the curves show."""
        ...

    def figure(self, study: Study) -> Figure:
        """The figure at two-column width."""
        ...

    def page(
        self, study: Study, facts: Sequence[Fact], tables: Sequence[Table], svg: str,
        figure_files: Sequence[str],
    ) -> Page:  # fmt: skip
        """The page."""
        ...


def of(problem: Problem) -> Kind:
    """The report of a problem: shielding from a shaken source with its map, or along a path."""
    from reports.fig2.report import Shielding
    from reports.path.report import Path

    shaken = isinstance(problem.drive, Harmonic | RampHarmonic)
    return Shielding() if shaken and problem.sweep is not None else Path()
