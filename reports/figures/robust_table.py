"""Lists what the cloak does as designed, as built, and with all that may be off."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from reports.facts import ABSENT, copies, rounded, worded
from reports.figures.loading_path import measures, monte_carlo, over_cases
from reports.page import RobustTable
from reports.study import StudyResults

Words = tuple[str, str]
"""Of a number: nominal or median, and what 95 % keep to."""


@dataclass(frozen=True)
class CloakNumber:
    """Describes a number of the cloak that should be small."""

    label: str
    unit: str
    nominal: Callable[[StudyResults], float]  # of a response
    of_copies: Callable[[xr.Dataset], xr.DataArray]  # (noise, sample), of the imperfect copies


def robust_table(study: StudyResults) -> RobustTable | None:
    """Lists the loss, and of a static path its measure as well; None without imperfect copies."""
    made = study.scatter
    if made is None:
        return None
    quantities = [*_measure(study), _loss(study)]
    rows = [
        (name, [(worded(each.nominal(shown), each.unit, 3), ABSENT) for each in quantities])
        for name, shown in (("as designed", study), ("as built", study.as_built))
        if shown is not None
    ]
    found = [copies.spreads(each.of_copies(made), made) for each in quantities]
    listed = sorted(
        zip(*found, strict=True), key=lambda row: copies.ORDER.index(row[0].noise.split()[0])
    )
    for row in listed:
        failed = f", {row[0].failed} failed" if row[0].failed else ""
        name = f"{copies.in_words(row[0].noise)} ({row[0].count} copies{failed})"
        rows.append(
            (
                name,
                [
                    _words(s.low, s.middle, s.high, q.unit)
                    for s, q in zip(row, quantities, strict=True)
                ],
            )
        )
    absent = [(ABSENT, ABSENT)] * (len(quantities) - 1)
    rows += [(name, [*absent, words]) for name, words in _other_losses(study, quantities[-1].unit)]
    return RobustTable([each.label for each in quantities], rows)


def _measure(study: StudyResults) -> Iterator[CloakNumber]:
    """Yields the measure at the end of a static path."""
    problem = study.problem
    if not problem.static:
        return
    measure = measures.measure_of(problem)

    def nominal(shown: StudyResults) -> float:
        whole = measures.overall(problem, over_cases(problem, measure.of(shown.response)))
        return float(whole.sel(structure="cloaked"))

    def of_copies(made: xr.Dataset) -> xr.DataArray:
        curves = monte_carlo.copy_curves(problem, measure, study.response, made)
        return measures.overall(problem, curves)

    yield CloakNumber(measure.label, measure.unit, nominal, of_copies)


def _loss(study: StudyResults) -> CloakNumber:
    def nominal(shown: StudyResults) -> float:
        return float(over_cases(study.problem, shown.response["loss"]).sel(structure="cloaked"))

    unit = "N mm" if study.problem.objective.kind == "strain_energy" else "1"
    return CloakNumber("Loss", unit, nominal, lambda made: made["loss"])


def _other_losses(study: StudyResults, unit: str) -> Iterator[tuple[str, Words]]:
    """Yields losses over measured constants, and over the loads of a map of drives."""
    sweep = study.problem.sweep
    mapped = sweep is not None and all(key.startswith("drive.") for key in sweep.keys)
    for name, made in (
        ("constants as measured on other specimens (%d draws)", study.constants),
        ("any load of the map (%d loads)", study.sweep if mapped else None),
    ):
        sound = None if made is None else made["loss"].values[(made["status"] == "ok").values]
        if sound is not None and sound.size:
            low, middle, high = np.percentile(sound, (5, 50, 95))
            yield name % sound.size, _words(float(low), float(middle), float(high), unit)


def _words(low: float, middle: float, high: float, unit: str) -> Words:
    return rounded(middle, (low, high), unit), rounded(high, (low, high), unit)
