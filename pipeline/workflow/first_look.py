"""Shows studies before they are computed: each in a picture, with its cost and what is doubtful."""

import argparse
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from pipeline.runtime import PREFIX, WORK, UserError
from pipeline.workflow.studies import Study, check_names, check_targets, joints, studies
from pipeline.workflow.target_words import built_by


def work(args: argparse.Namespace) -> None:
    """Shows one study, and poses its presets and designs: a preset's own where it names one.

    Raises:
        UserError: there is no such study or preset, it or a recording has a name that none can
            have or that a rule has, or a figure of several studies has it.
    """
    check_targets()
    if members := joints().get(args.study):
        remedy = f"check each by its own name: {', '.join(map(str, members))}"
        raise UserError("a figure of several studies", key="study", value=args.study, remedy=remedy)
    check_names(Study.parse(args.study))
    study = Study.parse(built_by(args.study))
    variants = _variants(study)
    for each in variants:
        check_names(each)
    sys.exit(_show(study, WORK, [each.preset for each in variants]))


def _variants(study: Study) -> list[Study]:
    """Lists the presets and designs of a study, or the designs of a preset."""
    above = f"{study.preset}." if study.preset else ""
    return [
        each
        for each in studies()
        if each.name == study.name and each != study and each.preset.startswith(above)
    ]


def show(names: Iterable[str]) -> None:
    """Shows studies, named as their folders of results are; a fault is told by their stages.

    The pictures go to the folder in which the workflow runs, as all that it makes.
    """
    for name in sorted(set(names)):
        _show(Study.parse(name), Path.cwd())


def _show(study: Study, folder: Path, variants: Sequence[str] = ()) -> int:
    command = [sys.executable, "-m", f"{PREFIX}reports", "check", *study.options.split()]
    command += ["--out-dir", f"results/{study}", *(["--variants", *variants] if variants else [])]
    shown = subprocess.run(command, cwd=folder, check=False)
    return shown.returncode
