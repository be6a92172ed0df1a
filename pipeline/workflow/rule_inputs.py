"""Answers the rules before anything runs: what a stage needs of a study.

A stage depends on sections of its problem file and on source (pipeline/runtime/source_closure.py).
Both enter the rules as hashes: a rerun follows from what a file says, never from its date. Nothing
heavy is imported here: this is the time one waits for "nothing to be done".
"""

import hashlib
import os
import sys
from collections.abc import Callable, Collection, Iterable, Sequence
from functools import partial
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import NoReturn

from snakemake.iocontainers import Wildcards

from pipeline.problem import (
    Problem,
    check_measured_constants,
    outputs,
    over_measured_constants,
    section_hash,
)
from pipeline.problem.reading import joint_figure
from pipeline.problem.sections import design_name, group_count, split_name
from pipeline.problem.sections import designs as designs_section
from pipeline.runtime import RUN_MARK, WORK, UserError
from pipeline.workflow.product_checks import check_products, presets_in_ranges, robust_presets
from pipeline.workflow.recordings import recording_pages, shown_recordings
from pipeline.workflow.runs import Run, study_lock
from pipeline.workflow.studies import (
    Study,
    check_calibrations,
    check_names,
    check_targets,
    problem_of,
    requested,
    targets,
    together,
)
from pipeline.workflow.target_words import available_targets, check_words

ROOM = 64 << 20  # bytes, somewhat more than a study takes


def datasets_of(shown: Sequence[Study]) -> list[str]:
    """Lists the datasets that are shown of some studies."""
    return [f"results/{study}/{name}.nc" for study in shown for name in outputs(problem_of(study))]


def comparisons_of(shown: Sequence[Study]) -> list[str]:
    """Lists their recordings beside their simulation."""
    return [
        f"results/{study}/recordings/{name}/comparison.nc"
        for study in shown
        for name in shown_recordings(str(study))
    ]


def hashes_of(shown: Sequence[Study]) -> str:
    """Hashes what pictures of them depend on in their problem files."""
    return " ".join(section_hash(problem_of(study), "report") for study in shown)


def any_of(names: Iterable[str]) -> str:
    """Makes a pattern that these names match, and nothing else does."""
    return "|".join(sorted(set(names))) or "(?!)"


def none_of(names: Iterable[str]) -> str:
    """Makes a pattern of a study's name that every name but these matches."""
    return rf"(?!({any_of(names)})\b)\w+"


def members(wildcards: Wildcards) -> list[str]:
    """Lists the datasets that a figure of several studies shows."""
    return datasets_of(together()[f"{wildcards.name}{wildcards.preset}"])


def shown_datasets(built: str, _: Wildcards | None = None) -> list[str]:
    """Lists the datasets that the page of a target shows: of a study, or of a figure of several."""
    if built in together():
        return datasets_of(together()[built])
    study = [Study.parse(built)]
    return [*datasets_of(study), *comparisons_of(study)]


def product_pages(built: str, product: str) -> list[str]:
    """Lists the pages of a product (`fabrication`, say) of a study, or of all of a figure."""
    names = together().get(built) or [Study.parse(built)]
    return [f"results/{study}/{product}/index.html" for study in names]


def products(words: Collection[str]) -> dict[str, list[str]]:
    """Maps the targets of products (`fig2_sweep`, say) that words name to their pages.

    Where a list of rules is asked for, of all products: some nine hundred, and as many rules take a
    quarter of the time in which nothing is found to be done.
    """
    known: dict[str, Callable[[], list[str]]] = {}
    for target, built in targets().items():
        known[f"{target}_recordings"] = partial(recording_pages, built)
        for made in ("fabrication", "spectrum", "sweep", "certificate"):
            known[f"{target}_{made}"] = partial(product_pages, built, made)
        study = Study.parse(built).name
        for made in ("gains", "front"):
            known[f"{study}_{made}"] = partial(list, [f"results/{study}/{made}/index.html"])
    listed = any(word.startswith("--list") or word in {"-l", "--lt"} for word in words)
    return {target: pages() for target, pages in known.items() if listed or target in words}


def packages(wildcards: Wildcards) -> list[str]:
    """Lists the packages of a study, one for each structure."""
    study = study_of(wildcards)
    return [
        f"results/{study}/fabrication/{structure}/manifest.json"
        for structure in structures_built(problem_of(study))
    ]


def structures_built(problem: Problem) -> tuple[str, ...]:
    """Lists the structures that a lab would build: the intact one where a void makes it differ."""
    both = ("altered", "cloaked")
    return both if problem.void is None else ("intact", *both)


def member_hashes(wildcards: Wildcards) -> str:
    """Hashes what the figure depends on in the problem files of its studies."""
    return hashes_of(together()[f"{wildcards.name}{wildcards.preset}"])


def figure_hash(wildcards: Wildcards) -> str:
    """Hashes what is told of a figure of several studies; a fault in it is told by its stage."""
    path = WORK / "experiments" / wildcards.name / "figure.yaml"
    try:
        described = joint_figure.load_joint_figure(path).model_dump_json()
    except UserError:
        return ""
    return hashlib.sha256(described.encode()).hexdigest()


def check_problems(words: Sequence[str]) -> None:
    """Ends the process with one clear message if a study that is asked for has a faulty problem.

    Snakemake would only find no rule to make its files, and count those that exist as up to date.
    """
    try:
        check_targets()
        if any("calibrat" in word for word in words):
            check_calibrations()
        check_words(words)
        for study in requested(words):
            check_names(study)
            check_measured_constants(problem_of(study), WORK / "experiments" / study.name)
        check_products(words)
    except UserError as error:
        sys.exit(f"error: {error}")


def no_target(_: Wildcards) -> NoReturn:
    """Ends the process where no target is named: there is none that everyone wants."""
    sys.exit(f"error: nothing to build\n  remedy: {available_targets()}")


def check_writable(folder: str) -> None:
    """Ends the process with one clear message if results cannot be written to the folder."""
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=path) as probe:
            if sys.platform != "darwin":  # macOS has no such call
                os.posix_fallocate(probe.fileno(), 0, ROOM)
    except OSError as error:
        told = UserError(
            f"results cannot be written: {error.strerror}",
            file=path.resolve(),
            remedy=f"make the folder writable, with {ROOM >> 20} MiB of free space",
        )
        sys.exit(f"error: {told}")


def hold_studies(files: Iterable[str]) -> None:
    """Locks the studies that files are of; ends the process with one clear message if it cannot."""
    try:
        study_lock.hold(files)
    except UserError as error:
        sys.exit(f"error: {error}")


def study_of(wildcards: Wildcards) -> Study:
    """Names the study that a job works on, from its wildcards `name` and, if any, `preset`."""
    return Study.parse(f"{wildcards.name}{wildcards.get('preset', '')}")


def options(wildcards: Wildcards) -> str:
    """Gives the options by which a stage finds its problem."""
    return study_of(wildcards).options


def designs(wildcards: Wildcards) -> list[str]:
    """Lists the designs to choose from, one for each method that the problem names."""
    study = study_of(wildcards)
    return [
        f"results/{study}/design_{method}.nc"
        for method in problem_of(study).optimiser.methods.chosen
    ]


def start_design(wildcards: Wildcards) -> list[str]:
    """Names the design that an optimisation starts from, where that is not the initial lattice."""
    study = study_of(wildcards)
    start = problem_of(study).optimiser.start
    preset, number = split_name(study.preset)
    if start == "previous" and preset and number and number > 1:
        return [f"results/{study.name}@{design_name(preset, number - 1)}/design.nc"]
    return [] if start == "initial" else [f"results/{study.name}/design.nc"]


def own_design(wildcards: Wildcards) -> list[str]:
    """Names the design of the study itself, for a preset of the same lattice and void.

    One of several designs of a preset stands beside the others, not beside the study's.
    """
    study = study_of(wildcards)
    mine, own = problem_of(study), problem_of(Study(study.name))
    alike = (mine.lattice, mine.void) == (own.lattice, own.void)
    wanted = alike and mine != own and split_name(study.preset)[1] is None
    return [f"results/{study.name}/design.nc"] if wanted else []


def robust_designs(wildcards: Wildcards) -> dict[str, str]:
    """Lists the study's own design ("plain") and those of its presets that ask for more."""
    held = robust_presets(wildcards.name)
    named = {study.preset: f"results/{study}/design.nc" for study in held}
    return {"plain": f"results/{wildcards.name}/design.nc", **named}


def robust_titles(wildcards: Wildcards) -> str:
    """Joins the titles of these presets, which stand in the dataset: no design depends on them."""
    return "\n".join(problem_of(study).title for study in robust_presets(wildcards.name))


def front_designs(wildcards: Wildcards) -> dict[str, str]:
    """Lists the designs of presets that ask for several under loads in ranges."""
    members = [each for group in presets_in_ranges(wildcards.name).values() for each in group]
    return {each.preset: f"results/{each}/design.nc" for each in members}


def front_certificates(wildcards: Wildcards) -> list[str]:
    """Lists the certificates of the ends of a front: of the first and the last share of it."""
    groups = presets_in_ranges(wildcards.name).items()
    share = designs_section.SHARE
    fronts = [group for study, group in groups if share in (problem_of(study).designs or {})]
    return [f"results/{group[k]}/certificate.nc" for group in fronts for k in (0, -1)]


def chunks(wildcards: Wildcards, most: int) -> list[str]:
    """Lists the parts of the sweep, at most so many and none without a case of its own."""
    sweep = problem_of(study_of(wildcards)).sweep
    return _parts(wildcards, "sweep", min(most, group_count(sweep) if sweep else 1))


def constants_file(wildcards: Wildcards) -> list[str]:
    """Names the file of the measured constants that the report shows the losses over."""
    named = problem_of(study_of(wildcards)).report.measured_constants
    return [os.path.normpath(f"experiments/{wildcards.name}/{named.file}")] if named else []


def constants_section(wildcards: Wildcards) -> str:
    """Hashes what the losses over measured constants depend on: the problem and the constants."""
    folder = WORK / "experiments" / wildcards.name
    return section_hash(over_measured_constants(problem_of(study_of(wildcards)), folder), "sweep")


def copies(wildcards: Wildcards, most: int) -> list[str]:
    """Lists the parts of the imperfect copies, at most so many and none without a copy."""
    robustness = problem_of(study_of(wildcards)).robustness
    return _parts(wildcards, "scatter", min(most, robustness.samples if robustness else 1))


def _parts(wildcards: Wildcards, kind: str, count: int) -> list[str]:
    study = study_of(wildcards)
    return [f"results/{study}/{kind}_{chunk}.nc" for chunk in range(count)]


def shown(wildcards: Wildcards) -> list[str]:
    """Lists the datasets that the report of a study shows."""
    study = study_of(wildcards)
    return [f"results/{study}/{name}.nc" for name in outputs(problem_of(study))]


def shown_options(wildcards: Wildcards) -> str:
    """Gives the options that name these datasets."""
    names = outputs(problem_of(study_of(wildcards)))
    files = zip(names, shown(wildcards), strict=True)
    return " ".join(f"--{name.replace('_', '-')} {file}" for name, file in files)


def section(stage: str) -> Callable[[Wildcards], str]:
    """Makes a function from wildcards to the hash of what `stage` needs of the problem file.

    A job with a wildcard `method` depends on that method's settings and not on the others'.
    """
    return lambda wildcards: section_hash(
        problem_of(study_of(wildcards)), stage, wildcards.get("method")
    )


def prepare_jobs(main: bool) -> None:
    """Makes the jobs of this workflow run with this Python, and marks them as this run's.

    A process that snakemake starts for one job, rather than the `main` one, keeps the mark.
    """
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    if main or RUN_MARK not in os.environ:
        os.environ[RUN_MARK] = f"{WORK}:{Run.own()}"
