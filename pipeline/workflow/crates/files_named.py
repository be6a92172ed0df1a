"""Lists the files below experiments/ that build what a crate holds, and those of no other study."""

import os
from collections.abc import Iterator
from pathlib import Path

from pipeline.problem.fields import named_files
from pipeline.runtime import ROOT, UserError
from pipeline.tracking import frames
from pipeline.workflow import recordings, studies

SCHEMA = Path("experiments/problem.schema.json")
_ABOUT = ("LICENSE*", "README*")


def named_outside(study: studies.Study) -> list[Path]:
    """Lists what a study's files name outside its folder, with the words on its origin beside it.

    Raises:
        UserError: one of them lies outside experiments/, so that a crate cannot hold it.
    """
    home, found = Path(study.problem).parent, set()
    for key, name in _named(study, home):
        path = Path(os.path.normpath(name))
        if path.is_relative_to(home):
            continue
        if not path.is_relative_to("experiments"):
            remedy = "move the file into experiments/ and name it there"
            what = "a crate cannot hold a file that lies outside experiments/"
            raise UserError(what, file=study.problem, key=key, value=str(path), remedy=remedy)
        around = (each for name in _ABOUT for each in (ROOT / path.parent).glob(name))
        found |= {path, *(each.relative_to(ROOT) for each in around)}
    return sorted(found)


def _named(study: studies.Study, home: Path) -> Iterator[tuple[str, Path]]:
    """Names the files of the problem, of that without a preset, and of the recordings shown."""
    for each in {study, studies.Study(study.name)}:
        yield from named_files(studies.problem_of(each), home).items()
    for name in recordings.shown_recordings(str(study)):
        path = home / f"recordings/{name}.yaml"
        yield from named_files(frames.load_recording(ROOT / path), path.parent).items()
