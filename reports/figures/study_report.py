"""Makes the report of a study: figure, page, facts and data tables."""

import argparse
from pathlib import Path
from typing import get_args

from pipeline.problem import Output
from reports.facts import fact_records
from reports.figures import kinds
from reports.page import Report, publish, study_page
from reports.study import StudyResults, study_results


def study_report(study: StudyResults) -> Report:
    """Returns the report of a study."""
    kind = kinds.kind_of(study.problem)
    facts = fact_records.quoted(kind.facts(study), study.problem.report.paper)
    figure = kind.figure(study)
    return study_page(
        study.name,
        {"": study},
        kind.text(study, figure.caption, facts),
        facts,
        [fact_records.table(facts), *figure.tables],
        figure.draw,
        kind.animation(study),
    )


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    files: dict[Output, Path] = {
        name: path for name in get_args(Output) if (path := getattr(args, name)) is not None
    }
    study = study_results.load(args.problem, args.preset, files, args.comparisons)
    publish(study_report(study), args.out_dir)
