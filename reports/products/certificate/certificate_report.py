"""Makes the report of a design under any load: figure, facts, claims, animation of the worst."""

import argparse
from dataclasses import replace

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.posing import under_worst
from reports.base import prose
from reports.facts import claims, fact_records
from reports.figures import kinds
from reports.page import Report, publish, study_page, study_text
from reports.products.certificate.facts import certificate_facts
from reports.products.certificate.figure import CertifiedDesign, certificate_figure
from reports.study import StudyResults, draft, study_results

HEADLINE = ("worst_found", "mean", "worst_over_mean", "nominal", "reduction")
"""Keys of the facts that stand above all others."""
_PROSE = prose(__file__)


def certificate_report(found: CertifiedDesign) -> Report:
    """Returns the report."""
    worst, data = found.worst, found.data
    facts, figure = certificate_facts(found), certificate_figure(found)
    text = study_text(
        worst,
        figure.caption,
        facts,
        credit=_PROSE["credit"].format(loads=data.sizes["load"], searches=data.sizes["search"]),
        headline=HEADLINE,
        note=_PROSE["note"],
    )
    return study_page(
        "certificate",
        {"": worst},
        replace(text, claimed=worst.target),
        facts,
        [fact_records.table(facts), *figure.tables],
        figure.draw,
        kinds.kind_of(worst.problem).animation(worst),
    )


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    asked, data = (
        problem.load(args.problem, args.preset),
        datasets.read(args.certificate, "certificate"),
    )
    study_results.check_problem(asked, "certify", data, args.certificate)
    posed, response = under_worst(asked, data), datasets.read(args.response, "response")
    study_results.check_problem(posed, "simulate", response, args.response)
    files = (args.design, args.response, args.certificate)
    worst = StudyResults(
        args.problem.resolve().parent.name,
        args.preset,
        posed,
        {"design": datasets.read(args.design, "design"), "response": response},
        {path.name: provenance.file_hash(path) for path in files},
        others={"certificate": data},
    )
    if not claims.assessed(worst.target, []):  # claims are on designs in their own right
        reduced = draft.reasons(asked, problem.load(args.problem))
        worst = replace(worst, draft=tuple(reduced))
    publish(certificate_report(CertifiedDesign(data, worst)), args.out_dir)
