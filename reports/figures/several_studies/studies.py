"""The studies of a joint figure with their datasets, checked to be alike."""

from __future__ import annotations

from pathlib import Path

from pipeline.problem.reading import JointFigure
from pipeline.runtime import UserError
from reports.study import StudyResults, study_results


def load(figure: Path, asked: JointFigure, preset: str | None, results: Path) -> list[StudyResults]:
    """The studies in their order.

    Raises:
        UserError: one of them is not like the others, or its datasets are missing.
    """
    found = []
    for name in asked.studies:
        path = figure.parent.parent / name / "problem.yaml"
        found.append(study_results.built(path, preset, results))
    for each in found:
        if not each.problem.static:
            raise UserError(
                f"{each.name} is not driven by a ramp",
                file=figure,
                key="studies",
                remedy="show studies along a load side by side",
            )
    return found
