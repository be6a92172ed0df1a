"""Refuses words of a command that name nothing here, with the names that may be meant.

Nothing heavy is imported here: this is the time one waits for "nothing to be done".
"""

import re
from collections.abc import Collection, Sequence
from difflib import get_close_matches
from itertools import takewhile

from pipeline.runtime import UserError
from pipeline.workflow.studies import (
    Study,
    check_folder,
    problem_of,
    rule_names,
    studies,
    targets,
    without_product,
)

_ALONE = {"-n", "--dry-run", "--dryrun"}
"""Options that no value follows, and targets often do."""


def check_words(words: Sequence[str]) -> None:
    """Refuses a word of a command that names nothing, unless it may be the value of an option.

    One of these is refused where it is near a target.

    Raises:
        UserError: naming the targets that may be meant, or a folder whose name no study can have.
    """
    known = {*targets(), *rule_names()}
    plain = [word for word in words if word not in _ALONE]
    leading = len(list(takewhile(lambda word: not word.startswith("-"), plain)))
    for place, word in enumerate(plain):
        named = without_product(word)
        check_folder(named)
        if not _may_be_target(word) or Study.parse(named).name in known:
            continue
        if place < leading or _near(named, known):
            raise _unknown("nothing", word, _near(named, known))


def built_by(word: str) -> str:
    """Finds the folder of results that a target fills: that of a study or of a figure of several.

    Raises:
        UserError: nothing, or no preset of the study, is named so, or a study cannot be.
    """
    check_folder(word)
    known = targets()
    if word in known:
        return known[word]
    study = Study.parse(word)
    if study.name in {each.name for each in studies()}:
        problem_of(study)  # tells of its presets
    raise _unknown("no study or figure", word, _near(word, known))


def available_targets() -> str:
    """Tells which studies and figures can be built, as a remedy."""
    names = sorted({Study.parse(built).name for built in targets().values()})
    told = f"name a target: {', '.join(names)}"
    return told if names else "make a study first, by the stage new"


def _unknown(what: str, word: str, near: Sequence[str]) -> UserError:
    remedy = f"did you mean {' or '.join(near)}?" if near else available_targets()
    return UserError(f"{what} is named {word}", key="target", value=word, remedy=remedy)


def _near(word: str, known: Collection[str]) -> list[str]:
    return get_close_matches(word, known, n=3, cutoff=0.75)


def _may_be_target(word: str) -> bool:
    """Tells a word that may be a target's, and is no option, number or file."""
    return re.fullmatch(r"[A-Za-z]\w*(@[\w.]*)?", word) is not None
