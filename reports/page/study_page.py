"""The page of a report from its parts: what every report tells in the same way."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Any

import xarray as xr

from pipeline.problem import canonical_json, content_hash
from reports.base import Table
from reports.facts import Fact, claims, worded
from reports.page.report_page import ReportPage, Source, source
from reports.panels import quantisation_error
from reports.study import StudyResults


@dataclass(frozen=True)
class PageText:
    """What a kind of report says of itself; `caption` is HTML, `headline` are keys of facts."""

    credit: str
    figure_title: str
    caption: str
    headline: Sequence[str]
    player_note: str = ""


def page(
    study: StudyResults,
    words: PageText,
    facts: Sequence[Fact],
    tables: Sequence[Table],
    player: Mapping[str, Any],
    svg: str,
    figure_files: Sequence[str],
) -> ReportPage:
    """The page of a study, of which everything else has been made."""
    by_key = {fact.key: fact for fact in facts}
    return ReportPage(
        title=study.problem.title or study.name,
        targets=[study.target],
        lead=study.problem.doc.strip(),
        credit=words.credit,
        figure_title=words.figure_title,
        caption=words.caption,
        svg=svg,
        figure_files=figure_files,
        datasets=[f"../{name}" for name in study.files],
        headline=[by_key[key] for key in words.headline if key in by_key],
        facts=facts,
        tables=tables,
        player=player,
        player_note=" ".join(filter(None, [rounding(player), words.player_note])),
        provenance=provenance(study),
        problem=json.dumps(
            json.loads(canonical_json(study.problem)), indent=1, sort_keys=True, ensure_ascii=False
        ),
        skipped=skipped(study.response),
        draft=study.draft,
        recordings=study.recordings,
        claims=[] if study.draft else claims.judged(study.name, facts),
    )


def rounding(player: Mapping[str, Any]) -> str:
    """What the player's data leave out."""
    shift, turn = quantisation_error(player)
    shown, saved = player["axis"]["shown"], player["axis"]["saved"]
    frames = "times" if player["axis"]["loops"] else "loads"
    return (
        f"{shown} of {saved} saved {frames}, rounded to ±{worded(shift, 'mm', 1)} and "
        f"±{worded(turn, 'rad', 1)}; between them the motion is interpolated."
    )


def skipped(response: xr.Dataset) -> list[str]:
    """What the simulation left out, each with the structures that it holds for."""
    plans = json.loads(response.attrs["plan"])
    names: dict[str, list[str]] = {}
    for structure, plan in plans.items():
        for text in plan["skipped"]:
            names.setdefault(text, []).append(structure)
    everywhere = len(plans)
    return [
        text if len(found) == everywhere else f"{text} ({', '.join(found)})"
        for text, found in names.items()
    ]


def provenance(study: StudyResults) -> list[Source]:
    """This page and every dataset that it shows."""
    packages = {name: version(name) for name in ("jinja2", "matplotlib", "numpy", "xarray")}
    made = {
        "problem_hash": content_hash(study.problem),
        "datasets": json.dumps(study.files),
        "packages": json.dumps(packages),
    }
    own = source("this page", xr.Dataset(attrs=made))
    return [own, *(source(f"{name}.nc", data) for name, data in study.datasets.items())]


def sources_of(studies: Mapping[str, StudyResults]) -> list[Source]:
    """Where a page of several studies, by name, is from."""
    return [
        replace(source, name=f"{name}: {source.name}")
        for name, study in studies.items()
        for source in provenance(study)
    ]


def skipped_of(studies: Sequence[StudyResults]) -> list[str]:
    """What the simulations of several studies left out, each once."""
    return list(dict.fromkeys(text for study in studies for text in skipped(study.response)))


def drafts_of(studies: Sequence[StudyResults]) -> list[str]:
    """Why a page of several studies is a draft, each reason once."""
    return list(dict.fromkeys(reason for study in studies for reason in study.draft))
