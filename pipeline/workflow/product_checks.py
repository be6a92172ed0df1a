"""Refuses products of studies that do not ask for them, before anything is computed for them.

Nothing heavy is imported here: this is the time one waits for "nothing to be done".
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import TYPE_CHECKING, NamedTuple

from pipeline.runtime import UserError
from pipeline.workflow.recordings import RECORDINGS, recording_pages
from pipeline.workflow.studies import (
    PRODUCTS,
    Study,
    families,
    joints,
    problem_of,
    targets,
    together,
)

if TYPE_CHECKING:
    from pipeline.problem import Problem


class _Requirement(NamedTuple):
    """Describes what a product needs of a problem."""

    what: str
    key: str
    remedy: str
    is_asked: Callable[[Problem], bool]


_OF_PROBLEM = {
    "_spectrum": _Requirement(
        "the study asks for no linear analysis",
        "spectrum",
        "give the section spectrum, with transmission: {from: 5 Hz, to: 200 Hz}",
        lambda asked: asked.spectrum is not None,
    ),
    "_sweep": _Requirement(
        "the study asks for no sweep",
        "sweep",
        "add sweep.grid, sweep.list or sweep.random",
        lambda asked: asked.sweep is not None,
    ),
    "_certificate": _Requirement(
        "the study asks for no loads in ranges",
        "objective.loads",
        "add objective.loads",
        lambda asked: asked.objective.loads is not None,
    ),
}


def check_products(words: Collection[str]) -> None:
    """Refuses targets of products, among the words of a command, that nothing would be shown by.

    Raises:
        UserError: a study does not ask for the product, or its several designs have no page; names
            file, key and remedy.
    """
    built = targets()
    for word in words:
        page = word.removeprefix("results/").removesuffix("/report/index.html")
        if page in built:
            _check_page(Study.parse(built[page]))
        for end in PRODUCTS:
            if word.endswith(end) and word.removesuffix(end) in built:
                _check_product(built[word.removesuffix(end)], end)


def _check_page(study: Study) -> None:
    """Refuses the page of several designs of a drive that is not harmonic: there is none."""
    designs = families().get(study, [])
    kinds = {str(problem_of(each).drive.kind) for each in designs}
    if others := kinds - {"harmonic", "ramp_harmonic"}:
        named = ", ".join(map(str, designs))
        remedy = f"build {named}, which have a page each"
        what = "the page of several designs is of harmonic drives"
        raise UserError(
            what, file=study.problem, key="drive.kind", value=min(others), remedy=remedy
        )


def _check_product(built: str, end: str) -> None:
    if end == RECORDINGS:
        _check_recordings(built)
    elif end in _OF_PROBLEM:
        for study in together().get(built) or [Study.parse(built)]:
            _check_problem(study, end)
    elif end in {"_gains", "_front"}:
        _check_presets(Study.parse(built), end)


def _check_recordings(built: str) -> None:
    if not recording_pages(built):
        folder = f"experiments/{Study.parse(built).name}/recordings"
        remedy = "describe a video, or a virtual one, in a file NAME.yaml of that folder"
        raise UserError("the study has no recordings", file=folder, remedy=remedy)


def _check_problem(study: Study, end: str) -> None:
    wanted = _OF_PROBLEM[end]
    if wanted.is_asked(problem_of(study)):
        return
    others = [each for each in families() if each.name == study.name and each.preset]
    named = [f"{each}{end}" for each in others if wanted.is_asked(problem_of(each))]
    remedy = wanted.remedy + (f", or build {', '.join(named[:3])}" if named else "")
    raise UserError(wanted.what, file=study.problem, key=wanted.key, remedy=remedy)


def _check_presets(study: Study, end: str) -> None:
    if study.name in joints():
        named = ", ".join(f"{each.name}{end}" for each in joints()[study.name])
        what = f"{study.name} is a figure of several studies"
        raise UserError(what, file=f"experiments/{study.name}/figure.yaml", remedy=f"build {named}")
    if end == "_gains" and not robust_presets(study.name):
        what = "no preset of the study's lattice and void asks for more than its own drive"
        remedy = "add a preset with objective.robust, or with a drive of another kind"
        raise UserError(what, file=study.problem, key="presets", remedy=remedy)
    if end == "_front" and not presets_in_ranges(study.name):
        what = "no preset of the study asks for several designs under loads in ranges"
        remedy = "add a preset with objective.loads and designs"
        raise UserError(what, file=study.problem, key="presets", remedy=remedy)


def robust_presets(name: str) -> list[Study]:
    """Lists the presets that ask for more than the study itself, of designs that fit both.

    Presets of several designs, or under loads in ranges, have their front and certificates.
    """
    own = problem_of(Study(name))
    mine = [each for each, group in families().items() if each.name == name and not group]
    return [each for each in mine if each.preset and _is_compared(problem_of(each), own)]


def _is_compared(asked: Problem, own: Problem) -> bool:
    """Tells a preset whose design is compared with that of the study `own` under what it asks."""
    alike = (asked.lattice, asked.void) == (own.lattice, own.void)
    return alike and asked.objective.loads is None and asked.asks_more_than(own)


def presets_in_ranges(name: str) -> dict[Study, list[Study]]:
    """Lists the presets of a study that ask for several designs under loads in ranges."""
    return {
        study: group
        for study, group in families().items()
        if study.name == name
        and study.preset
        and group
        and problem_of(group[0]).objective.loads is not None
    }
