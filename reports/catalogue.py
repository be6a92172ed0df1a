"""Lists the reports that `python -m reports KIND` makes, and the options of each.

Nothing of a report is imported here, so that --help is instant and the hash of a rule's sources
follows its own kind alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple


class ReportOption(NamedTuple):
    """Describes an option of a command line: its flag, and what argparse knows of it."""

    flag: str
    settings: Mapping[str, Any]


class ReportCommand(NamedTuple):
    """Describes a kind of report.

    Attributes:
        module: holds the function `report`, which makes it from the parsed options.
        description: what it reads and writes.
        options: beside those of a study.
        study: whether it wants --problem and --preset.
    """

    module: str
    description: str
    options: tuple[ReportOption, ...]
    study: bool = True


def path_option(flag: str, metavar: str, words: str, **settings: object) -> ReportOption:
    """Describes an option that names files or a folder; required, if `settings` do not differ."""
    known = {"type": Path, "required": "default" not in settings, "metavar": metavar}
    return ReportOption(flag, known | {"help": words} | settings)


OUT_DIR = path_option("--out-dir", "FOLDER", "where all of its files go")
RESULTS = path_option("--results", "FOLDER", "where the datasets of studies are")
COMPARISONS = path_option(
    "--comparisons", "NC", "recordings beside their simulation, each in a folder of its name",
    nargs="*", default=(),
)  # fmt: skip
DATASETS = tuple(
    path_option(f"--{name}", "NC", f"the {name} dataset")
    if name in ("design", "response")
    else path_option(f"--{name}", "NC", f"the {name} dataset, if the problem has one", default=None)
    for name in (
        *("design", "response", "sweep", "scatter", "verification"),
        *("geometric-design", "geometric-response"),
    )
)


def _drawn(dataset: str) -> tuple[ReportOption, ...]:
    return path_option(f"--{dataset}", "NC", "the dataset that is drawn"), OUT_DIR


REPORTS: dict[str, ReportCommand] = {
    "study": ReportCommand(
        "reports.figures.study_report",
        "Draws a study: figure (PDF, SVG, PNG), page, facts and data tables.",
        (*DATASETS, COMPARISONS, OUT_DIR),
    ),
    "several-studies": ReportCommand(
        "reports.figures.several_studies.several_studies_report",
        "Draws several studies on one page: figure, facts and tables.",
        (
            path_option("--figure", "YAML", "the studies"),
            ReportOption("--preset", {"metavar": "NAME", "help": "a preset that all of them have"}),
            RESULTS,
            OUT_DIR,
        ),
        study=False,
    ),
    "several-designs": ReportCommand(
        "reports.figures.several_designs.several_designs_report",
        "Draws several designs of one problem on one page: figure, facts and tables.",
        (RESULTS, OUT_DIR),
    ),
    "framework": ReportCommand(
        "reports.figures.framework.framework_report",
        "Draws Figure 1, the framework, from the geometry and the motion of a shaken study.",
        (RESULTS, COMPARISONS, OUT_DIR),
    ),
    "sweep": ReportCommand(
        "reports.products.sweep.sweep_report",
        "Draws a sweep over any parameters: figure, its cases as CSV, and one page.",
        _drawn("sweep"),
    ),
    "spectrum": ReportCommand(
        "reports.products.spectrum",
        "Draws a spectrum: figure, its curves as CSV, and one page.",
        _drawn("spectrum"),
    ),
    "robust-gains": ReportCommand(
        "reports.products.robust_gains",
        "Draws what designs gain that hold against more: figure, table, and one page.",
        _drawn("gains"),
    ),
    "calibration": ReportCommand(
        "reports.products.calibration",
        "Draws a calibration: fit.pdf, fit.svg and fit.png.",
        _drawn("calibration"),
        study=False,
    ),
    "tracking": ReportCommand(
        "reports.products.tracking.tracking_report",
        "Draws a track: an overlay on its video, and one page on how good the recording is.",
        (
            path_option("--track", "NC", "the track"),
            path_option("--video", "FILE", "its video"),
            ReportOption(
                "--colour",
                {
                    "choices": ("displacement", "rotation"),
                    "default": "displacement",
                    "help": "of units (%(default)s)",
                },
            ),
            OUT_DIR,
        ),
        study=False,
    ),
    "fabrication": ReportCommand(
        "reports.products.fabrication.fabrication_report",
        "Draws what is built of a study: sheets, plates, specimens, as their files have them.",
        (
            path_option("--packages", "FOLDER", "the packages", nargs="+"),
            path_option("--out", "HTML", "the page"),
        ),
    ),
    "movie": ReportCommand(
        "reports.products.movie.movie_report",
        "Draws a movie of one or several studies, one after another, with their recordings.",
        (
            path_option("--problems", "YAML", "the studies", nargs="+"),
            RESULTS,
            COMPARISONS,
            path_option("--out", "MP4", "the movie"),
        ),
        study=False,
    ),
    "benchmark": ReportCommand(
        "reports.products.benchmark.benchmark_report",
        "Draws benchmarks: a picture, a table and what failed, of every dataset given.",
        (path_option("--datasets", "NC", "what was measured", nargs="+"), OUT_DIR),
        study=False,
    ),
    "stress": ReportCommand(
        "reports.products.stress",
        "Draws the counts of the stress suite: one page, and its table as CSV.",
        (path_option("--counts", "JSON", "of the suite"), OUT_DIR),
        study=False,
    ),
    "survival": ReportCommand(
        "reports.products.survival",
        "Draws what was tried to lose or to spoil results, of the counts in a folder.",
        (path_option("--out-dir", "FOLDER", "of the counts, and of the page"),),
        study=False,
    ),
    "index": ReportCommand(
        "reports.products.index.index_report",
        "Draws the index over all reports, datasets, packages and recordings that are there.",
        (path_option("--results", "FOLDER", "of results (%(default)s)", default=Path("results")),),
        study=False,
    ),
}
