"""Makes the report of a study: figure, page, facts and data tables."""

from __future__ import annotations

import argparse

from pipeline.runtime import REPORTED
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
    named = {kind: getattr(args, kind) for kind in REPORTED}
    files = {kind: path for kind, path in named.items() if path is not None}
    study = study_results.load(args.problem, args.preset, files, args.comparisons)
    publish(study_report(study), args.out_dir)
