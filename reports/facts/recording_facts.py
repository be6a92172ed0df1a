"""Describes the numbers of recordings beside their simulation, the same for every study."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from reports.facts.fact_records import Fact, facts_of, grouped, worded
from reports.facts.rounded_intervals import rounded, span
from reports.study import RecordedMotion
from sim.core import Floats

_told = facts_of(__file__)
DOFS = {"ux": "u_x", "uy": "u_y", "theta": "θ"}


def recorded_facts(recordings: Sequence[RecordedMotion]) -> list[Fact]:
    """Tells how far measurement and simulation are apart, under a heading for each recording."""
    return [
        fact
        for each in recordings
        for fact in grouped(f"Recording “{each.name}”: {each.source}", _facts(each))
    ]


def intervals(measured: Floats, predicted: Floats, level: float, unit: str = "1") -> str:
    """Finds the ends (2,) of an interval, and of that which imperfect specimens span, in words.

    That holds a part `level` of them.
    """
    words = f"95 %: {span(measured, unit)}"
    if np.isfinite(predicted).all():
        words += f"; predicted, {100 * level:g} %: {span(predicted, unit)}"
    return words


def _facts(recording: RecordedMotion) -> Iterator[Fact]:
    data, told = recording.data, partial(_told, name=recording.name)
    frames, used = len(recording.along), int((data["use"] == 0).sum())
    yield told("{name}_frames", frames, frames=frames, used=used, how=data.attrs["alignment"])
    for dof, symbol in DOFS.items():
        off = {side: data["rmse"].sel(side=side, dof=dof) for side in ("simulated", "nominal")}
        value, low, high = (float(each) for each in off["simulated"].values)
        stated = float(off["nominal"].sel(estimate="value"))
        unit, ends = "rad" if dof == "theta" else "mm", (low, high)
        words = {"symbol": symbol, "span": span(ends), "stated": rounded(stated, ends, unit)}
        shown = rounded(value, ends, unit)
        yield told("{name}_rmse_{dof}", value, shown, dof=dof, of=unit, **words)
    for key in ("nrmse", "noise_share"):
        values = data[key].sel(side="simulated", estimate="value").values
        pairs = zip(DOFS.values(), values, strict=True)
        note = "; ".join(f"{symbol} {100 * v:.3g} %" for symbol, v in pairs)
        yield told(f"{{name}}_{key}", float(np.nanmean(values)), note=note)
    values = data["correlation"].sel(side="simulated", estimate="value").values
    yield told("{name}_correlation", float(np.nanmin(values)))
    yield from _alignment(recording)


def _alignment(recording: RecordedMotion) -> Iterator[Fact]:
    data, told = recording.data, partial(_told, name=recording.name)
    lag = data["phase_lag"].sel(side="simulated", dof="uy", estimate="value")
    if np.isfinite(lag):
        yield told("{name}_phase", float(np.degrees(lag)))
    gain = float(data["drive_gain"])
    if np.isfinite(gain):
        yield told("{name}_gain", gain)
    pixel, stated = float(data["pixel_size"]), float(data["pixel_size_stated"])
    if np.isfinite(ratio := pixel / stated):
        yield told("{name}_pixel", ratio, f"{ratio:.4f}", pixel=pixel, stated=stated)
    if samples := int(data["band_samples"]):
        usual = 100 * float(np.nanmean(data["band_coverage_usual"].values))
        covered = float(np.nanmean(data["band_coverage"].values))
        words = {"samples": samples, "level": 100 * recording.level, "usual": usual}
        yield told("{name}_coverage", covered, **words)
    force = float(data["force_rmse"].sel(side="simulated", estimate="value"))
    if np.isfinite(force):
        part = 100 * float(data["force_nrmse"].sel(side="simulated", estimate="value"))
        yield told("{name}_force", force, part=worded(part, "%", 3))
