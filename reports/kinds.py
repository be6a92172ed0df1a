"""Which report a study gets, by what its problem asks for and not by its name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure

from pipeline.problem import Problem
from pipeline.problem.drives import Harmonic, RampHarmonic
from reports import content
from reports.content import Words
from reports.facts import Fact
from reports.mapped import MAPPED
from reports.page import Page
from reports.player import Reel, payload
from reports.study import Study
from reports.tables import Table


@dataclass(frozen=True)
class Kind:
    """The parts of a report, each made from a study.

    Attributes:
        facts: numbers computed from the datasets.
        tables: what the curves show.
        figure: the figure at two-column width.
        words: what the page says of itself.
        animation: what the page's player and movies show.
    """

    facts: Callable[[Study], list[Fact]]
    tables: Callable[[Study], list[Table]]
    figure: Callable[[Study], Figure]
    words: Callable[[Study], Words]
    animation: Callable[[Study], Reel]

    def page(
        self, study: Study, facts: Sequence[Fact], tables: Sequence[Table], svg: str,
        figure_files: Sequence[str],
    ) -> Page:  # fmt: skip
        """The page of a study, of which everything else has been made."""
        words, player = self.words(study), payload(self.animation(study))
        return content.page(study, words, facts, tables, player, svg, figure_files)


def of(problem: Problem) -> Kind:
    """The report of a problem: shielding from a source with its map, of a wave, or of a path."""
    shaken, sweep = isinstance(problem.drive, Harmonic | RampHarmonic), problem.sweep
    if shaken and sweep is not None and sweep.grid is not None and set(sweep.keys) == {*MAPPED}:
        return _shielding()
    mimics = problem.objective.kind == "displacement" and problem.objective.target == "intact"
    return _of_a_wave() if mimics and not problem.static else _along_a_path()


def _shielding() -> Kind:
    from reports.fig2 import content as about
    from reports.fig2 import facts, figure, tables

    return Kind(facts.collect, tables.build, figure.build, about.words, about.animation)


def _along_a_path() -> Kind:
    from reports.path import content as about
    from reports.path import facts, figure, tables

    return Kind(facts.collect, tables.build, figure.build, about.words, about.animation)


def _of_a_wave() -> Kind:
    from reports.path import content as path
    from reports.wave import content as about
    from reports.wave import facts, figure, tables

    return Kind(facts.collect, tables.build, figure.build, about.words, path.animation)
