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


_KNOWN = prose(__file__)
OPTIONS: dict[str, dict[str, Any]] = {
    f"--{name}": {"type": Path} | settings for name, settings in _KNOWN["options"].items()
}
"""Settings of every option, as argparse takes them."""

REPORTS = {kind: ReportCommand(**command) for kind, command in _KNOWN["reports"].items()}
