"""Makes the report of a study: figure, page, facts and data tables."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import get_args

from pipeline.problem import Output
from reports.facts import ABSENT, Fact, fact_records, grouped
from reports.figures import kinds
from reports.figures.robust_table import robust_table
from reports.page import Report, publish, study_page
from reports.study import StudyResults, study_results

BUILT = "built_"
"""Begins the keys of facts of the structures as built."""


def study_report(study: StudyResults) -> Report:
    """Returns the report of a study."""
    kind = kinds.kind_of(study.problem)
    facts = fact_records.quoted(kind.facts(study), study.problem.report.paper)
    figure = kind.figure(study)
    text = kind.text(study, figure.caption, facts)
    built = as_built_facts(study, kind, text.headline)
    words = {fact.key.removeprefix(BUILT): fact.ours for fact in built}
    text = replace(text, built=words, robust=robust_table(study))
    facts += built
    return study_page(
        study.name,
        {"": study},
        text,
        facts,
        [fact_records.table(facts), *figure.tables],
        figure.draw,
        kind.animation(study),
    )


def as_built_facts(
    study: StudyResults, kind: kinds.ReportKind, headline: Sequence[Fact]
) -> list[Fact]:
    """Returns facts of the headline with shims bent as their slots are drawn, where that matters.

    Robustness and sweeps are of the structures as designed, and have no such facts.
    """
    if (built := study.as_built) is None:
        return []
    named = {fact.key for fact in headline if not fact.key.startswith("map_")}
    found = (fact for fact in kind.facts(built) if fact.key in named)
    told = (replace(fact, key=f"{BUILT}{fact.key}", paper=ABSENT) for fact in found)
    return grouped("As built", told)


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    files: dict[Output, Path] = {
        name: path for name in get_args(Output) if (path := getattr(args, name)) is not None
    }
    study = study_results.load(args.problem, args.preset, files, args.comparisons)
    publish(study_report(study), args.out_dir)
