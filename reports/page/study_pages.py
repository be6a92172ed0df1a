"""Lays out the page of one or several studies: one HTML file that works from disk."""

import base64
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from pipeline.datasets import SYNTHETIC_LABEL
from pipeline.posing import altered_lattice_of, flat_vertices, soft_units
from pipeline.problem import Problem, canonical_json, content_hash
from reports.base import Table
from reports.facts import ABSENT, Fact, claims, foil, worded
from reports.page import citation
from reports.page.report import Report
from reports.panels import Animation, payload, quantisation_error
from reports.paper_figures import movies_of
from reports.study import StudyResults

LARGEST_PAGE = 6_000_000
"""Bytes that a page may have."""


@dataclass(frozen=True)
class RobustTable:
    """Holds measures of the cloak as designed and of imperfect copies, in words.

    `rows` are the specimens, and of each measure the middle of their values and the value that 95 %
    of them keep to.
    """

    measures: Sequence[str]
    rows: Sequence[tuple[str, Sequence[tuple[str, str]]]]


@dataclass(frozen=True)
class PageText:
    """Holds what a page says of itself.

    `caption` is HTML; `headline` are the facts above all others, `note` is told of the animation;
    `robust` stands below the headline, if there is one; `built` are the words for facts of the
    headline of the structures as built, by key; `claimed` is what claims are judged of, where that
    is not the figure.
    """

    title: str
    lead: str
    credit: str
    figure_title: str
    caption: str
    headline: Sequence[Fact]
    note: str = ""
    robust: RobustTable | None = None
    built: Mapping[str, str] = field(default_factory=dict)
    claimed: str = ""


def study_text(
    study: StudyResults,
    caption: str,
    facts: Sequence[Fact],
    *,
    credit: str,
    headline: Sequence[str],
    figure_title: str = "Figure",
    note: str = "",
) -> PageText:
    """Returns the text of one study; `headline` are keys of facts, as far as there are such."""
    by_key = {fact.key: fact for fact in facts}
    title = study.problem.title or study.name
    shown = [by_key[key] for key in headline if key in by_key]
    lead = study.problem.doc.strip()
    return PageText(title, lead, credit, figure_title, caption, shown, note)


Source = tuple[str, list[tuple[str, str]]]
"""Names a part of the page, a dataset say, with its attributes."""


def study_page(
    name: str,
    studies: Mapping[str, StudyResults],
    text: PageText,
    facts: Sequence[Fact],
    tables: Sequence[Table],
    figure: Callable[[], Figure],
    animation: Animation,
    together: tuple[str, Problem] | None = None,
) -> Report:
    """Returns the report of studies, of which everything else has been made.

    The claims on a single study are those on what builds it, since a preset is another design; the
    claims on several are those on the figure of that name. Studies are named as their datasets are
    called beside others'; a single one needs no name. `together` is what builds all studies and the
    problem that asks for them, where one does.
    """
    player, single = payload(animation), "" in studies
    several = list(studies.values())
    draft = list(dict.fromkeys(reason for study in several for reason in study.draft))
    claimed = text.claimed or (studies[""].target if single else name)
    judged = [] if draft else claims.assessed(claimed, facts)
    recordings = studies[""].recordings if single else []
    synthetic = SYNTHETIC_LABEL if any(each.synthetic for each in recordings) else ""
    targets = [together[0]] if together else [study.target for study in several]
    problems = {study.name: study.problem for study in several}
    asked = studies[""].problem if single else together and together[1]
    values = {
        **{key: value for key, value in vars(text).items() if key != "note"},
        "targets": targets,
        "movies": movies_of(targets),
        "datasets": [
            f"../{file}" if single else f"../../{study.target}/{file}"
            for study in several
            for file in study.files
        ],
        "facts": facts,
        "quotes": any(fact.paper != ABSENT for fact in facts),
        # "</" would end the script element that holds the data.
        "player": json.dumps(player, ensure_ascii=False).replace("</", "<\\/"),
        "player_note": " ".join(filter(None, [rounding(player), text.note])),
        "provenance": [each for label, study in studies.items() for each in sources(study, label)],
        "problem": _json(asked or problems),
        "skipped": _notes_of(studies, _skipped),
        "draft": draft,
        "warnings": _notes_of(studies, _warnings),
        "recordings": recordings,
        "synthetic": synthetic,
        "claims": judged,
        "verdict": claims.verdict(judged, synthetic),
        "quoted": claims.quoted(judged),
        "citations": citation.citations(),
    }
    downloads = {table.name: base64.b64encode(table.csv).decode("ascii") for table in tables}
    return Report({name: figure}, "page.html.j2", values | {"base64": downloads}, tables, facts)


def _json(problem: Problem | Mapping[str, Problem]) -> str:
    if isinstance(problem, Problem):
        content = json.loads(canonical_json(problem))
    else:
        content = {name: json.loads(canonical_json(each)) for name, each in problem.items()}
    return json.dumps(content, indent=1, sort_keys=True, ensure_ascii=False)


def rounding(player: Mapping[str, Any]) -> str:
    """Tells what the player's data leave out."""
    shift, turn = quantisation_error(player)
    shown, saved = player["axis"]["shown"], player["axis"]["saved"]
    frames = "times" if player["axis"]["loops"] else "loads"
    return (
        f"{shown} of {saved} saved {frames}, rounded to ±{worded(shift, 'mm', 1)} and "
        f"±{worded(turn, 'rad', 1)}; between them the motion is interpolated."
    )


def _notes_of(
    studies: Mapping[str, StudyResults], tell: Callable[[StudyResults], list[str]]
) -> list[str]:
    """Lists what is told of studies, each once, with the names of those that it holds for."""
    names: dict[str, list[str]] = {}
    for name, study in studies.items():
        for line in dict.fromkeys(tell(study)):
            names.setdefault(line, []).append(name)
    return [
        line if len(found) == len(studies) else f"{', '.join(found)}: {line}"
        for line, found in names.items()
    ]


def _skipped(study: StudyResults) -> list[str]:
    """Tells what the simulation left out, each with the structures that it holds for."""
    plans = json.loads(study.response.attrs["plan"])
    names: dict[str, list[str]] = {}
    for structure, plan in plans.items():
        for text in plan["skipped"]:
            names.setdefault(text, []).append(structure)
    return [
        text if len(found) == len(plans) else f"{text} ({', '.join(found)})"
        for text, found in names.items()
    ]


def _warnings(study: StudyResults) -> list[str]:
    """Lists what may not be meant in the structures that were simulated, each once."""
    told = [study.response] if study.as_built is None else [study.response, study.as_built.response]
    plans = [plan for each in told for plan in json.loads(each.attrs["plan"]).values()]
    said = list(dict.fromkeys(text for plan in plans for text in plan.get("warnings", ())))
    lattice, cloaked = altered_lattice_of(study.problem), study.response.sel(structure="cloaked")
    soft = soft_units(study.problem, lattice, flat_vertices(lattice, cloaked["vertices"]))
    return [*said, *foil.strain_warning(study.problem, study.design, study.response), *soft]


def sources(study: StudyResults, label: str = "") -> Iterator[Source]:
    """Yields where a page is from: of itself, and of every dataset of a study that it shows."""
    packages = {name: version(name) for name in ("jinja2", "matplotlib", "numpy", "xarray")}
    made = {
        "problem_hash": content_hash(study.problem),
        "datasets": json.dumps(study.files),
        "packages": json.dumps(packages),
    }
    before = f"{label}: " if label else ""
    yield _source(f"{before}this page", xr.Dataset(attrs=made))
    for name, data in (*study.datasets.items(), *study.others.items()):
        yield _source(f"{before}{name}.nc", data)


def _source(name: str, data: xr.Dataset) -> Source:
    """Returns attributes of a dataset, except the problem, which the page shows once."""
    kept = {str(key): value for key, value in data.attrs.items() if key != "problem"}
    return name, [entry for key in sorted(kept) for entry in _entries(key, kept[key])]


def _entries(key: str, value: object) -> list[tuple[str, str]]:
    """Returns an attribute as lines of text; JSON in it is unfolded, one line a leaf or a list."""
    if isinstance(value, str) and value.startswith(("{", "[")):
        value = json.loads(value)
    if isinstance(value, dict):
        return [line for name in sorted(value) for line in _entries(f"{key}: {name}", value[name])]
    items = value if isinstance(value, list) else [value]
    return [(key, "; ".join(str(item) for item in items))]
