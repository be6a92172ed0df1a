"""Describes recordings along the path: in the form of responses, as curves, and as numbers."""

from collections.abc import Callable, Collection, Iterator, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from pipeline.comparison import compute_reduction, often_seen
from reports.base import style
from reports.facts import MEASURED, Fact, facts_of, intervals, rounded
from reports.figures.loading_path import measures
from reports.figures.loading_path.abscissa import Abscissa, load_names
from reports.figures.loading_path.measures import Measure
from reports.panels import measured_overlay
from reports.study import RecordedMotion, StudyResults, display_name, takes
from sim.core import Floats

Of = Callable[[xr.Dataset], xr.DataArray]
Number = tuple[float, str]
"""Of a fact: value, and it in words; without these it has the usual digits."""
Under = tuple[str, str]
"""Ends of a fact's key and of its label that tell the load case."""

_NAMES = {"rotation": "mean_rotation", "mismatch": "mimicking_error", "contraction": "contraction"}
"""Quantities that comparisons follow, by the key of the report's measure."""
_ENDS = ("low", "high")
_SIDES = ("measured", "simulated")
_CASE = ("case", "under")
_told = facts_of(__file__)


def response(study: StudyResults, path: Abscissa, recording: RecordedMotion) -> xr.Dataset:
    """Forms a recording like the study's response, the simulated intact structure beside it.

    Units that were seldom seen are left out, as in what the comparison follows.
    """
    held = study.response["structure"].values
    names = [name for name in held if name in {"intact", recording.structure}]
    part = study.response.sel(structure=names).isel(case=[recording.case])
    dims = ("structure", "case", "time", "unit", "dof")
    motion = part["displacement"].transpose(*dims).copy(deep=True)
    shown = recording.data["measured"].transpose("time", "unit", "dof")
    measured = recording.at(shown, path.values)
    measured[:, ~often_seen(shown.values)] = np.nan
    motion.values[names.index(recording.structure), 0] = measured
    return part.assign(displacement=motion)


def curve(study: StudyResults, path: Abscissa, recording: RecordedMotion, of: Of) -> Floats:
    """Tells what `of` makes of a recording (n_times,), NaN where nothing was recorded."""
    made = response(study, path, recording)
    values = of(made).sel(structure=recording.structure).isel(case=0)
    motion = made["displacement"].sel(structure=recording.structure).isel(case=0)
    seen = motion.notnull().any(("unit", "dof"))
    return values.where(seen).transpose("time").values


def measured_curves(
    axes: Axes, study: StudyResults, path: Abscissa, of: Of, names: Collection[str]
) -> None:
    """Draws the same of every recording of these structures, dashed with markers."""
    for each in study.recordings:
        if each.structure not in names:
            continue
        colour = style.STRUCTURE_COLOURS[each.structure]
        measured_overlay.measured_curve(axes, path.values, curve(study, path, each, of), colour)


def has_bands(study: StudyResults, key: str) -> bool:
    """Tests if a quantity has prediction bands."""
    return key in _NAMES and bool(study.recordings)


def bands(axes: Axes, study: StudyResults, key: str, names: Collection[str]) -> None:
    """Draws prediction bands of a quantity of these structures, where comparisons have them."""
    for each in study.recordings if has_bands(study, key) else ():
        if each.structure not in names:
            continue
        low, high = (each.values(_followed(each, key, "simulated", end)) for end in _ENDS)
        measured_overlay.band(axes, each.along, low, high, style.STRUCTURE_COLOURS[each.structure])


def _followed(recording: RecordedMotion, key: str, source: str, estimate: str) -> xr.DataArray:
    """Returns a quantity (time,) of a comparison, in the unit of the report."""
    values = recording.data[_NAMES[key]].sel(source=source, estimate=estimate)
    return np.degrees(values) if key == "rotation" else values  # type: ignore[return-value]


def _at_the_end(recording: RecordedMotion, path: Abscissa, key: str, source: str) -> Floats:
    """Returns value, lower and upper end of its interval (3,) at the end of the path."""
    estimates = ("value", *_ENDS)
    found = [_followed(recording, key, source, estimate) for estimate in estimates]
    return np.array([recording.at(values, path.values)[-1] for values in found])


def forces(axes: Axes, study: StudyResults) -> None:
    """Draws forces of the load cell with the prediction bands, of the recordings that have one."""
    for each in study.recordings:
        force, low, high = (
            each.values(each.data[name]) for name in ("load_force", "force_low", "force_high")
        )
        if np.isfinite(force).any():
            colour = style.STRUCTURE_COLOURS[each.structure]
            measured_overlay.band(axes, each.along, low, high, colour)
            measured_overlay.measured_curve(axes, each.along, force, colour)


def measured_facts(study: StudyResults, path: Abscissa) -> Iterator[Fact]:
    """Yields the measure and the contraction of the path, as they were measured, by load case."""
    measure = measures.measure_of(study.problem)
    cases = sorted({each.case for each in study.recordings})
    names = load_names(study.problem, study.response)
    for case in cases:
        recorded = [each for each in study.recordings if each.case == case]
        under: Under = ("", "") if len(cases) == 1 else (f"_case{case}", f", {names[case]}")
        yield from _measure_facts(study, recorded, path, measure, under)
        if path.static and measures.contracts_freely(study.problem, study.response):
            yield from _contraction_facts(study, recorded, path, under)


def _taken(under: Under, take: int) -> Under:
    """Adds the take, if there are several; the first has the key of an only one."""
    key, label = under
    return f"{key}_take{take}" if take > 1 else key, f"{label}, take {take}" if take else label


def _contraction_facts(
    study: StudyResults, recorded: Sequence[RecordedMotion], path: Abscissa, under: Under
) -> Iterator[Fact]:
    def contraction(made: xr.Dataset) -> xr.DataArray:
        return measures.contraction(study.problem, made)

    ends: dict[str, float] = {}
    for each in recorded:
        values, taken = curve(study, path, each, contraction), _taken(under, each.take)
        ends[each.name] = values[-1]
        number, words = _interval(each, path, ("contraction", "mm"), values[-1])
        note = f"{each.source}; {words}"
        yield _of(study, "contraction_{structure}", each.structure, number, taken, note=note)
    for take, some in takes(recorded):
        of = {each.structure: ends[each.name] for each in some}
        for name in [name for name in ("altered", "cloaked") if {name, "intact"} <= of.keys()]:
            off, taken = of[name] / of["intact"] - 1.0, _taken(under, take)
            number, note = _change(some, path, "contraction", ("intact", name), off)
            yield _of(study, "contraction_error_{structure}", name, number, taken, note=note)


def _of(
    study: StudyResults, key: str, structure: str, number: Number, under: Under, /, **words: object
) -> Fact:
    shown = display_name(study.problem, structure).lower()
    words |= {"measured": MEASURED, "structure": structure, "shown": shown}
    return _told(
        f"{{measured}}{key}{{case}}", *number, **words, **dict(zip(_CASE, under, strict=True))
    )


def _measure_facts(
    study: StudyResults,
    recorded: Sequence[RecordedMotion],
    path: Abscissa,
    measure: Measure,
    under: Under,
) -> Iterator[Fact]:
    """Yields the measure at the end of a path, its root mean square of a motion in time."""
    ends: dict[str, float] = {}
    of = {"key": measure.key, "what": measure.label, "unit": measure.unit}
    for each in recorded:
        if each.structure == "intact":
            continue
        values, taken = curve(study, path, each, measure.of), _taken(under, each.take)
        course = xr.DataArray(values, dims="time")
        ends[each.name] = end = float(measures.overall(study.problem, course))
        number, words = _interval(each, path, (measure.key, measure.unit), end)
        note = f"{each.source}; {words}".removesuffix("; ")
        yield _of(study, "{key}_{structure}", each.structure, number, taken, note=note, **of)
        most = float(np.nanmax(values))
        yield _of(study, "{key}_{structure}_most", each.structure, (most, ""), taken, **of)
    for take, some in takes(recorded):
        named = {each.structure: each.name for each in some}
        if not {"altered", "cloaked"} <= named.keys():
            continue
        gain = 1.0 - ends[named["cloaked"]] / ends[named["altered"]]
        number, note = _change(some, path, measure.key, ("altered", "cloaked"), gain)
        named = {"measured": MEASURED, "key": measure.key, "what": measure.label}
        named |= dict(zip(_CASE, _taken(under, take), strict=True))
        yield _told("{measured}{key}_reduction{case}", *number, note=note, **named)


def _interval(
    recording: RecordedMotion, path: Abscissa, quantity: tuple[str, str], value: float
) -> tuple[Number, str]:
    """Words a quantity, of a key in a unit, at the end of the path: it, its interval, the band."""
    key, unit = quantity
    if key not in _NAMES or not path.static:
        return (value, ""), ""
    measured, predicted = (_at_the_end(recording, path, key, side)[1:] for side in _SIDES)
    words = intervals(measured, predicted, recording.level, unit)
    return (value, rounded(value, measured, unit)), words


def _change(
    recorded: Sequence[RecordedMotion],
    path: Abscissa,
    key: str,
    between: tuple[str, str],
    value: float,
) -> tuple[Number, str]:
    """Words likewise by which share two structures differ in a quantity.

    It is what the second takes from the first, from the intact one what is added.
    """
    if key not in _NAMES or not path.static:
        return (value, ""), ""
    ends, sign = [], -100 if between[0] == "intact" else 100
    for side in _SIDES:
        of = {each.structure: _at_the_end(each, path, key, side) for each in recorded}
        ends.append(np.sort(sign * compute_reduction(*(of[name] for name in between))[1:]))
    words = intervals(ends[0], ends[1], recorded[0].level, "%")
    return (value, rounded(100 * value, ends[0], "%")), words
