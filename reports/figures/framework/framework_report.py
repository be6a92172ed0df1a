"""Makes the report of Figure 1, the framework, from a shaken study."""

import argparse

from reports.figures.framework.figure import framework_figure
from reports.page import Report, citation, publish, sources
from reports.study import StudyResults, study_results

NAME = "fig1"
TITLE = "Design framework for nonlinear mechanical cloaks"


def framework_report(study: StudyResults) -> Report:
    """Returns figure and page of the framework."""
    figure = framework_figure(study)
    values = {
        "title": TITLE,
        "caption": figure.caption,
        "datasets": [f"../../{study.target}/{name}" for name in study.files],
        "study": study.target,
        "provenance": list(sources(study)),
        "citations": citation.citations(),
    }
    return Report({NAME: figure.draw}, "plate.html.j2", values)


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    shown = [file.parent.name for file in args.comparisons]
    study = study_results.load_built(args.problem, args.preset, args.results, shown)
    publish(framework_report(study), args.out_dir)
