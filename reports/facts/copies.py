"""States which values imperfect copies of the design keep to."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from reports.facts.fact_records import Fact, facts_of
from reports.facts.rounded_intervals import rounded, span
from reports.study import StudyResults

ORDER = ("vertices", "stiffness", "together", "common", "geometry")
"""First words of the noises as a table lists them."""

_told = facts_of(__file__)


@dataclass(frozen=True)
class Spread:
    """Holds percentiles of a number over the copies with one kind of noise, and their counts."""

    noise: str
    low: float
    middle: float
    high: float
    count: int
    failed: int
    clashing: int


def spreads(values: xr.DataArray, copies: xr.Dataset) -> list[Spread]:
    """Spreads values (noise, sample) of every kind of noise: 5 %, 50 % and 95 % percentiles."""
    found = []
    for noise in copies["noise"].values:
        part = copies.sel(noise=noise)
        good = values.sel(noise=noise).values[(part["status"] == "ok").values]
        low, middle, high = np.percentile(good, (5, 50, 95)) if len(good) else (np.nan,) * 3
        found.append(
            Spread(
                str(noise), float(low), float(middle), float(high),
                len(good), part["sample"].size - len(good), int((part["clashes"] > 0).sum()),
            )
        )  # fmt: skip
    return found


def worst_copy_fact(key: str, label: str, unit: str, found: Sequence[Spread]) -> Iterator[Fact]:
    """Yields the value that 95 % of the copies keep to, with all imperfections at once.

    Where these were not tried together, under the most harmful one.
    """
    known = [each for each in found if np.isfinite(each.high)]
    if known:
        worst = max(known, key=lambda each: (each.noise.startswith("together"), each.high))
        told = {"key": key, "what": label, "unit": unit}
        note = in_words(worst.noise)
        if worst.failed:
            note += f"; {worst.failed} of {worst.count + worst.failed} copies failed, not counted"
        shown = rounded(worst.high, (worst.low, worst.high), unit)
        yield _told("{key}_copies", worst.high, shown, note=note, **told)


def loss_facts(study: StudyResults) -> Iterator[Fact]:
    """Yields what the loss of 95 % of the copies keeps to, and its spread; nothing without any."""
    if (made := study.scatter) is not None:
        unit = "N mm" if study.problem.objective.kind == "strain_energy" else "1"
        found = spreads(made["loss"], made)
        yield from worst_copy_fact("loss", "Loss", unit, found)
        yield from spread_facts("Loss", unit, found)


def spread_facts(label: str, unit: str, found: Sequence[Spread]) -> Iterator[Fact]:
    """Yields the median of a number over the copies of each kind."""
    for spread in found:
        key = re.sub(r"\W+", "_", spread.noise).strip("_")
        ends = (spread.low, spread.high)
        told = {"what": label, "noise": in_words(spread.noise), "unit": unit, "ends": span(ends)}
        shown = rounded(spread.middle, ends, unit)
        yield _told("copies_{key}", spread.middle, shown, key=key, spread=spread, **told)


def in_words(noise: str) -> str:
    """Says a kind and size of imperfection in words."""
    kind, _, size = noise.partition(" ")
    if kind == "together":
        shift, _, scatter = size.partition(", ")
        return f"vertices off by up to ±{shift} and stiffnesses with {scatter} standard deviation"
    if kind in ("geometry", "vertices"):
        return f"vertices off by up to ±{size}{' of s' if kind == 'geometry' else ''}"
    of = "each stiffness of all ligaments alike" if kind == "common" else "stiffnesses"
    return f"{of} with {size} standard deviation"
