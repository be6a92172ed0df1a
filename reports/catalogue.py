"""Reads catalogue.yaml: the reports that `python -m reports KIND` makes, and their options.

Nothing of a report is imported here, so that --help is instant and the hash of a rule's sources
follows its own kind alone.
"""

from pathlib import Path
from typing import Any, NamedTuple

from reports.base import prose


class ReportCommand(NamedTuple):
    """Describes a kind of report; catalogue.yaml tells what its attributes mean."""

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
            *("design", "response", "built", "sweep", "constants", "scatter", "verification"),
            *("geometric-design", "geometric-response", "spectrum", "gains", "certificate"),
            *("calibration", "track"),
            *("samples", "cycles", "pictures"),
        )
    },
    "--datasets": _path("NC", "what was measured", nargs="+"),
    "--comparisons": _path("NC", "recordings beside their simulation", nargs="*", default=()),
    "--results": _path("FOLDER", "where datasets are (%(default)s)", default=Path("results")),
    "--problems": _path("YAML", "the studies", nargs="+"),
    "--figure": _path("YAML", "the studies"),
    "--preset": {"metavar": "NAME", "help": "a preset that all of them have"},
    "--folder": _path("FOLDER", "where the pictures are"),
    "--packages": _path("FOLDER", "the packages", nargs="+"),
    "--counts": _path("JSON", "of the suite"),
    "--video": _path("FILE", "its video"),
    "--colour": {"choices": ("displacement", "rotation"), "default": "displacement"},
    "--out": _path("FILE", "the page, or the movie"),
    "--out-dir": _path("FOLDER", "where all of its files go"),
}
"""What argparse knows of every option."""

REPORTS = {kind: ReportCommand(**command) for kind, command in prose(__file__).items()}
