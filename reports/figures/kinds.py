"""Chooses the report of a study, by what its problem asks for and not by its name."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.problem import Problem
from pipeline.problem.sections import HarmonicDrive, Quads, RampHarmonicDrive, Sweep, resolve_centre
from reports.facts import Fact
from reports.figures import loading_path, shielding, wave
from reports.figures.shielding import MAPPED
from reports.page import PageText, study_text
from reports.panels import Animation, PanelFigure
from reports.study import StudyResults


@dataclass(frozen=True)
class ReportKind:
    """Holds the parts of a report, each made from a study."""

    name: str  # in figures.yaml
    facts: Callable[[StudyResults], list[Fact]]  # numbers computed from the datasets
    figure: Callable[[StudyResults], PanelFigure]  # its panels with captions and tables
    text: Callable[[StudyResults, str, Sequence[Fact]], PageText]  # by caption and facts
    animation: Callable[[StudyResults], Animation]  # what the page's player and movies show


def _wave_text(study: StudyResults, caption: str, facts: Sequence[Fact]) -> PageText:
    gains = ("error_reduction", "loss_reduction")
    headline = ("error_altered", "error_cloaked", *gains, "loss_end", "loss_copies")
    paper = study.problem.report.paper
    return study_text(study, caption, facts, credit=loading_path.credit(paper), headline=headline)


SHIELDING = ReportKind(
    "shielding",
    shielding.facts.shielding_facts,
    shielding.figure.shielding_figure,
    shielding.figure.shielding_text,
    shielding.figure.shielding_animation,
)
LOADING_PATH = ReportKind(
    "loading_path",
    loading_path.facts.loading_path_facts,
    loading_path.figure.loading_path_figure,
    loading_path.figure.loading_path_text,
    loading_path.figure.loading_path_animation,
)
WAVE = ReportKind(
    "wave",
    wave.facts.wave_facts,
    wave.figure.wave_figure,
    _wave_text,
    loading_path.figure.loading_path_animation,
)


def kind_of(problem: Problem) -> ReportKind:
    """Returns the report of a problem: shielding with its map, of a wave, or along a path.

    That of shielding is of squares with a round cloak in their middle.
    """
    shaken = isinstance(problem.drive, HarmonicDrive | RampHarmonicDrive)
    if shaken and _is_mapped(problem.sweep) and _is_central(problem):
        return SHIELDING
    mimics = problem.objective.kind == "displacement" and problem.objective.target == "intact"
    return WAVE if mimics and not problem.static else LOADING_PATH


def _is_mapped(sweep: Sweep | None) -> bool:
    """Tells a sweep over several directions and several frequencies."""
    if sweep is None or sweep.grid is None or set(sweep.keys) != {*MAPPED}:
        return False
    return min(map(len, sweep.values.values())) > 1


def _is_central(problem: Problem) -> bool:
    """Tells a round cloak about the middle of a lattice of squares."""
    lattice, bounds = problem.lattice, problem.cloak.bounds
    if bounds is None or not isinstance(lattice, Quads):
        return False
    return bool(np.allclose(resolve_centre(bounds[0], lattice.centre_site), lattice.centre_site))
