"""Lists the reports that `python -m reports KIND` makes, and the options of each.

Nothing of a report is imported here, so that --help is instant and the hash of a rule's sources
follows its own kind alone.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple


class ReportCommand(NamedTuple):
    """Describes a kind of report.

    Attributes:
        module: holds the function `report`, which makes it from the parsed options.
        options: names in OPTIONS, with a question mark where one may be left out.
        description: what it makes.
        study: whether it wants --problem and --preset.
    """

    module: str
    options: str
    description: str
    study: bool = True


def _path(metavar: str, words: str, **settings: object) -> dict[str, Any]:
    return {"type": Path, "metavar": metavar, "help": words, **settings}


OPTIONS: dict[str, dict[str, Any]] = {
    **{
        f"--{name}": _path("NC", f"the {name} dataset")
        for name in (
            *("design", "response", "sweep", "scatter", "verification", "geometric-design"),
            *("geometric-response", "spectrum", "gains", "calibration", "track"),
            *("samples", "cycles"),
        )
    },
    "--datasets": _path("NC", "what was measured", nargs="+"),
    "--comparisons": _path("NC", "recordings beside their simulation", nargs="*", default=()),
    "--results": _path("FOLDER", "where datasets are (%(default)s)", default=Path("results")),
    "--problems": _path("YAML", "the studies", nargs="+"),
    "--figure": _path("YAML", "the studies"),
    "--preset": {"metavar": "NAME", "help": "a preset that all of them have"},
    "--packages": _path("FOLDER", "the packages", nargs="+"),
    "--counts": _path("JSON", "of the suite"),
    "--video": _path("FILE", "its video"),
    "--colour": {"choices": ("displacement", "rotation"), "default": "displacement"},
    "--out": _path("FILE", "the page, or the movie"),
    "--out-dir": _path("FOLDER", "where all of its files go"),
}
"""What argparse knows of every option."""

REPORTS = {
    "study": ReportCommand(
        "reports.figures.study_report",
        "--design --response --sweep? --scatter? --verification? --geometric-design?"
        " --geometric-response? --comparisons? --out-dir",
        "Draws a study: figure (PDF, SVG, PNG), page, facts and data tables.",
    ),
    "several-studies": ReportCommand(
        "reports.figures.several_studies.several_studies_report",
        "--figure --preset? --results? --out-dir",
        "Draws several studies on one page: figure, facts and tables.",
        study=False,
    ),
    "several-designs": ReportCommand(
        "reports.figures.several_designs.several_designs_report",
        "--results? --out-dir",
        "Draws several designs of one problem on one page: figure, facts and tables.",
    ),
    "framework": ReportCommand(
        "reports.figures.framework.framework_report",
        "--results? --comparisons? --out-dir",
        "Draws Figure 1, the framework, from the geometry and the motion of a shaken study.",
    ),
    "sweep": ReportCommand(
        "reports.products.sweep.sweep_report",
        "--sweep --out-dir",
        "Draws a sweep over any parameters: figure, its cases as CSV, and one page.",
    ),
    "spectrum": ReportCommand(
        "reports.products.spectrum",
        "--spectrum --out-dir",
        "Draws a spectrum: figure, its curves as CSV, and one page.",
    ),
    "robust-gains": ReportCommand(
        "reports.products.robust_gains",
        "--gains --out-dir",
        "Draws what designs gain that hold against more: figure, table, and one page.",
    ),
    "calibration": ReportCommand(
        "reports.products.calibration",
        "--calibration --out-dir",
        "Draws a calibration: fit.pdf, fit.svg and fit.png.",
        study=False,
    ),
    "validation": ReportCommand(
        "reports.products.validation.validation_report",
        "--samples --cycles --out-dir",
        "Draws measured specimens beside their prediction: figures, tables, and one page.",
        study=False,
    ),
    "tracking": ReportCommand(
        "reports.products.tracking.tracking_report",
        "--track --video --colour? --out-dir",
        "Draws a track: an overlay on its video, and one page on how good the recording is.",
        study=False,
    ),
    "fabrication": ReportCommand(
        "reports.products.fabrication.fabrication_report",
        "--packages --out",
        "Draws what is built of a study: sheets, plates, specimens, as their files have them.",
    ),
    "movie": ReportCommand(
        "reports.products.movie.movie_report",
        "--problems --results? --comparisons? --out",
        "Draws a movie of one or several studies, one after another, with their recordings.",
        study=False,
    ),
    "benchmark": ReportCommand(
        "reports.products.benchmark.benchmark_report",
        "--datasets --out-dir",
        "Draws benchmarks: a picture, a table and what failed, of every dataset given.",
        study=False,
    ),
    "stress": ReportCommand(
        "reports.products.stress",
        "--counts --out-dir",
        "Draws the counts of the stress suite: one page, and its table as CSV.",
        study=False,
    ),
    "survival": ReportCommand(
        "reports.products.survival",
        "--out-dir",
        "Draws what was tried to lose or to spoil results, of the counts in the folder.",
        study=False,
    ),
    "index": ReportCommand(
        "reports.products.index.index_report",
        "--results?",
        "Draws the index over all reports, datasets, packages and recordings that are there.",
        study=False,
    ),
}
