"""Which report a study gets, by what its problem asks for and not by its name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure

from pipeline.problem import Problem
from pipeline.problem.drives import Harmonic, RampHarmonic
from reports.facts import Fact
from reports.page import Page
from reports.study import Study
from reports.tables import Table


@dataclass(frozen=True)
class Kind:
    """The parts of a report, each made from a study.

    Attributes:
        facts: numbers computed from the datasets.
        tables: what the curves show.
        figure: the figure at two-column width.
        page: the page, from the study, facts, tables, SVG of the figure and names of its files.
    """

    facts: Callable[[Study], list[Fact]]
    tables: Callable[[Study], list[Table]]
    figure: Callable[[Study], Figure]
    page: Callable[[Study, Sequence[Fact], Sequence[Table], str, Sequence[str]], Page]


def of(problem: Problem) -> Kind:
    """The report of a problem: shielding from a shaken source with its map, or along a path."""
    shaken = isinstance(problem.drive, Harmonic | RampHarmonic)
    return _shielding() if shaken and problem.sweep is not None else _along_a_path()


def _shielding() -> Kind:
    from reports.fig2 import content, facts, figure, tables

    return Kind(facts.collect, tables.build, figure.build, content.build)


def _along_a_path() -> Kind:
    from reports.path import content, facts, figure, tables

    return Kind(facts.collect, tables.build, figure.build, content.build)
