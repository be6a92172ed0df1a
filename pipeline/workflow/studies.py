"""Lists the studies and figures below experiments/, and what builds them.

Nothing heavy is imported here: this is the time one waits for "nothing to be done".
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.problem import reading, sections
from pipeline.runtime import ROOT, WORK, UserError
from pipeline.workflow.recordings import RECORDINGS

if TYPE_CHECKING:
    from pipeline.problem import Problem

PRODUCTS = ("_fabrication", "_spectrum", "_sweep", "_gains", "_certificate", "_front", RECORDINGS)
"""Ends of the targets of a study beside its report."""
ALL = "all"  # the target that builds every figure of the paper


@dataclass(frozen=True, order=True)
class Study:
    """Names one study, with one preset of its problem file or with none ("")."""

    name: str
    preset: str = ""

    @classmethod
    def parse(cls, text: str) -> Study:
        """Reads "fig2" or "fig2@edge3"."""
        name, _, preset = text.partition("@")
        return cls(name, preset)

    def __str__(self) -> str:
        return f"{self.name}@{self.preset}" if self.preset else self.name

    @property
    def targets(self) -> tuple[str, ...]:
        """Lists the names under which a command line may ask for the study."""
        return (str(self), f"{self.name}_{self.preset}") if self.preset else (self.name,)

    @property
    def all_targets(self) -> list[str]:
        """Lists these names, and those of its products."""
        return [f"{name}{end}" for name in self.targets for end in ("", *PRODUCTS)]

    @property
    def problem(self) -> str:
        """Gives the path of the problem file, from the folder of the work."""
        return f"experiments/{self.name}/problem.yaml"

    @property
    def options(self) -> str:
        """Gives the options by which a stage finds the problem."""
        return f"--problem {self.problem}" + (f" --preset {self.preset}" if self.preset else "")


@cache
def families(root: Path = WORK) -> Mapping[Study, list[Study]]:
    """Lists every study, each followed by its presets, with their several designs.

    A file that is no YAML counts as a study without presets: the stage that reads it tells why.
    """
    found = {}
    for path in sorted(root.glob("experiments/*/problem.yaml")):
        content = reading.yaml_file.read_quickly(path)
        presets = content.pop("presets", None)
        for preset, laid in {"": {}, **(presets if isinstance(presets, dict) else {})}.items():
            whole = reading.overlay_keys(content, laid if isinstance(laid, dict) else {})
            names = (
                sections.design_name(str(preset), k + 1)
                for k in range(sections.design_count(whole))
            )
            study = Study(path.parent.name, str(preset))
            found[study] = [Study(study.name, name) for name in names]
    return found


def studies(root: Path = WORK) -> list[Study]:
    """Lists every study with its presets and designs."""
    return [each for study, designs in families(root).items() for each in (study, *designs)]


@cache
def joints(root: Path = WORK) -> Mapping[str, list[Study]]:
    """Lists the studies of every figure of several, with each preset that all of them have.

    A file that cannot be read counts as a figure of no studies: the stage that reads it tells why.
    """
    found: dict[str, list[Study]] = {}
    for path in sorted(root.glob("experiments/*/figure.yaml")):
        name = path.parent.name
        try:
            members = reading.joint_figure.load_joint_figure(path).studies
        except UserError:
            members = ()
        presets = [set(reading.preset_names(path.parents[1] / m / "problem.yaml")) for m in members]
        for preset in ("", *sorted(set.intersection(*presets) if presets else ())):
            found[str(Study(name, preset))] = [Study(member, preset) for member in members]
    return found


@cache
def together() -> Mapping[str, list[Study]]:
    """Lists the studies of every page of several, by target."""
    several = {str(study): designs for study, designs in families().items() if designs}
    return {**joints(), **several}


def targets() -> dict[str, str]:
    """Maps every target to what it builds: the folder of a study or of a figure of several."""
    single = {target: str(study) for study in studies() for target in study.targets}
    return single | {figure: figure for figure in together()}


def figures() -> list[str]:
    """Lists the studies that are figures of the paper, by their names."""
    return sorted(name for name in targets() if re.fullmatch(r"fig\d+", name))


def present(named: Mapping[str, Collection[str]]) -> dict[str, list[Study]]:
    """Keeps the groups of names whose studies are all below experiments/, with these studies."""
    there = {study.name for study in studies()}
    return {
        name: [Study(each) for each in group]
        for name, group in named.items()
        if there.issuperset(group)
    }


def requested(words: Collection[str]) -> list[Study]:
    """Finds the studies that a command line names, by target or by a file of theirs.

    A preset counts even if its problem file has none of that name: reading the problem tells so.
    """
    by_target = {target: study for study in studies() for target in study.targets}
    names = {study.name for study in by_target.values()}
    several = together()
    words = [*words, *(figures() if ALL in words else ())]
    words = [without_product(word) for word in words]
    found = [study for word in words for study in several.get(word, ())]
    for word in words:
        study = by_target.get(word) or Study.parse(word.removeprefix("results/").partition("/")[0])
        if study.name in names:
            found.append(study)
    return found


def without_product(word: str) -> str:
    """Cuts the end of a product's target off; a word without one stays."""
    return next((word.removesuffix(end) for end in PRODUCTS if word.endswith(end)), word)


def check_names(study: Study, root: Path = WORK) -> None:
    """Refuses names that targets and files cannot have: of the study, its preset, its recordings.

    Raises:
        UserError: one has more than letters, digits and underscores.
    """
    folder = root / "experiments" / study.name
    preset = study.preset.partition(".")[0]
    recordings = sorted((folder / "recordings").glob("*.yaml"))
    named = [
        ("a study", study.name, folder),
        *([("a preset", preset, folder / "problem.yaml")] if preset else []),
        *(("a recording", path.stem, path) for path in recordings),
    ]
    for what, name, path in named:
        _check_name(what, name, path, root)


def check_folder(word: str, root: Path = WORK) -> None:
    """Refuses a word that is a folder of experiments with a name that no study can have.

    An "@" in it would be read as the begin of a preset.

    Raises:
        UserError: the name has more than letters, digits and underscores.
    """
    folder = root / "experiments" / word
    if "/" not in word and folder.is_dir():
        _check_name("a study", word, folder, root)


def _check_name(what: str, name: str, path: Path, root: Path) -> None:
    if not re.fullmatch(r"\w+", name):
        remedy = f"name it {re.sub(r'[^0-9A-Za-z]+', '_', name).strip('_') or 'mine'}"
        if "/" in name:
            remedy = "give the name of a folder of experiments, not its path"
        raise UserError(
            f"the name of {what} may have letters, digits and underscores only",
            file=path.relative_to(root) if path.is_relative_to(root) else path,
            value=name,
            remedy=remedy,
        )


def check_targets(root: Path = WORK) -> None:
    """Refuses studies and presets whose targets are those of others, of rules, or of products.

    Raises:
        UserError: of all of them, the first with its file, key and remedy.
    """
    owners = _reserved()
    faults = []
    for study in sorted(_all_named(root), key=lambda each: (each.preset, each.name)):
        for target in study.all_targets:
            if owners.setdefault(target, f"the study {study}") != f"the study {study}":
                faults.append((study, target, owners[target]))
                break
    if not faults:
        return
    (study, target, owner), *others = faults
    preset = study.preset.partition(".")[0]
    also = ", ".join(str(each) for each, *_ in others)
    raise UserError(
        f"the target {target} would be both of {study} and of {owner}",
        file=_definition(study, root),
        key=f"presets.{preset}" if preset else None,
        value=preset or study.name,
        remedy=f"rename {'the preset' if preset else 'its folder'}"
        + (f"; and likewise of: {also}" if also else ""),
    )


def check_new(name: str, root: Path = WORK) -> None:
    """Refuses a name for a new study whose targets, with a preset `quick`, others have.

    Raises:
        UserError: naming one of these targets and what it builds.
    """
    owners = _reserved()
    for study in _all_named(root):
        owners |= dict.fromkeys(study.all_targets, f"the study {study}")
    for target in (*Study(name).all_targets, *Study(name, "quick").all_targets):
        if target in owners:
            what = f"the target {target} is that of {owners[target]}"
            raise UserError(what, key="name", value=name, remedy="choose another name")


def _all_named(root: Path) -> list[Study]:
    return [*studies(root), *(Study.parse(name) for name in joints(root))]


def _definition(study: Study, root: Path) -> Path:
    """Finds the file that a study, or a figure of several, is described in."""
    path = root / study.problem
    return (path if path.exists() else path.with_name("figure.yaml")).relative_to(root)


def _reserved() -> dict[str, str]:
    """Maps names that no study can have to what has them."""
    rules = dict.fromkeys(rule_names(), "a rule of the workflow")
    return dict.fromkeys(_make_targets(), "a command of make") | rules


@cache
def _make_targets() -> tuple[str, ...]:
    """Lists what make does besides building studies; nothing in an installed package."""
    path = ROOT / "Makefile"
    text = path.read_text() if path.is_file() else ""
    return tuple(" ".join(re.findall(r"^\.PHONY:([^$\n]*)", text, re.MULTILINE)).split())


@cache
def rule_names() -> tuple[str, ...]:
    """Lists the names of the rules, and of the folders of results that are no study's."""
    text = "".join(path.read_text() for path in sorted((ROOT / "pipeline/rules").glob("*.smk")))
    folders = re.findall(r"\bresults/(\w+)/", text)
    rules = re.findall(r"^rule (\w+):", text + (ROOT / "Snakefile").read_text(), re.MULTILINE)
    return tuple(sorted({*rules, *folders}))


def check_calibrations(root: Path = WORK) -> None:
    """Refuses calibrations whose names cannot be those of folders of results.

    Raises:
        UserError: one has more than letters, digits and underscores.
    """
    for path in sorted((root / "experiments/calibration").glob("*.yaml")):
        _check_name("a calibration", path.stem, path, root)


@cache
def problem_of(study: Study) -> Problem:
    """Reads the problem of a study.

    Raises:
        UserError: the problem file is wrong; tells where and what to do.
    """
    return reading.load(study.problem, study.preset or None)
