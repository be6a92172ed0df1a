"""Describes a fault in a problem that only several of its sections show."""

from collections.abc import Iterator
from dataclasses import dataclass

from pipeline.problem.reading.yaml_file import KeyPath


@dataclass(frozen=True)
class ProblemFault:
    """Reports a fault in a problem, its key, and its remedy."""

    what: str
    keys: KeyPath
    remedy: str


Findings = Iterator[ProblemFault]
