"""Which report a study gets, by what its problem asks for and not by its name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure

from pipeline.problem import Problem
from pipeline.problem.sections import HarmonicDrive, RampHarmonicDrive
from reports.base import Table
from reports.facts import Fact
from reports.figures.loading_path import content as path
from reports.figures.shielding import MAPPED
from reports.figures.shielding import content as about
from reports.page import PageText, ReportPage, study_page
from reports.panels import Animation, payload
from reports.study import StudyResults


@dataclass(frozen=True)
class ReportKind:
    """The parts of a report, each made from a study.

    Attributes:
        facts: numbers computed from the datasets.
        tables: what the curves show.
        figure: the figure at two-column width.
        words: what the page says of itself.
        animation: what the page's player and movies show.
    """

    facts: Callable[[StudyResults], list[Fact]]
    tables: Callable[[StudyResults], list[Table]]
    figure: Callable[[StudyResults], Figure]
    words: Callable[[StudyResults], PageText]
    animation: Callable[[StudyResults], Animation]

    def page(
        self, study: StudyResults, facts: Sequence[Fact], tables: Sequence[Table], svg: str,
        figure_files: Sequence[str],
    ) -> ReportPage:  # fmt: skip
        """The page of a study, of which everything else has been made."""
        words, player = self.words(study), payload(self.animation(study))
        return study_page.page(study, words, facts, tables, player, svg, figure_files)


def kind_of(problem: Problem) -> ReportKind:
    """The report of a problem: shielding from a source with its map, of a wave, or of a path."""
    shaken, sweep = isinstance(problem.drive, HarmonicDrive | RampHarmonicDrive), problem.sweep
    if shaken and sweep is not None and sweep.grid is not None and set(sweep.keys) == {*MAPPED}:
        return _shielding()
    mimics = problem.objective.kind == "displacement" and problem.objective.target == "intact"
    return _of_a_wave() if mimics and not problem.static else _along_a_path()


def _shielding() -> ReportKind:
    from reports.figures.shielding import facts, figure, tables

    return ReportKind(
        facts.shielding_facts,
        tables.shielding_tables,
        figure.draw_shielding,
        about.shielding_text,
        about.shielding_animation,
    )


def _along_a_path() -> ReportKind:
    from reports.figures.loading_path import content as about
    from reports.figures.loading_path import facts, figure, tables

    return ReportKind(
        facts.loading_path_facts,
        tables.loading_path_tables,
        figure.draw_loading_path,
        about.loading_path_text,
        about.loading_path_animation,
    )


def _of_a_wave() -> ReportKind:
    from reports.figures.wave import content as about
    from reports.figures.wave import facts, figure, tables

    return ReportKind(
        facts.wave_facts,
        tables.wave_tables,
        figure.draw_wave,
        about.wave_text,
        path.loading_path_animation,
    )
