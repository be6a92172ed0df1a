"""Describes the numbers of recordings beside their simulation, the same for every study."""

from collections.abc import Iterator, Sequence

import numpy as np

from reports.facts.fact_records import Fact, grouped, number, share, worded
from reports.study import RecordedMotion
from sim.core import Floats

DOFS = {"ux": "u_x", "uy": "u_y", "theta": "θ"}


def recorded_facts(recordings: Sequence[RecordedMotion]) -> list[Fact]:
    """Tells how far measurement and simulation are apart, under a heading for each recording."""
    return [
        fact
        for each in recordings
        for fact in grouped(f"Recording “{each.name}”: {each.source}", _facts(each))
    ]


def intervals(measured: Floats, predicted: Floats, unit: str = "") -> str:
    """Finds the ends (2,) of an interval, and of that which imperfect specimens span, in words."""
    words = f"95 %: {measured[0]:.3g} to {measured[1]:.3g}{unit}"
    if np.isfinite(predicted).all():
        words += f"; predicted {predicted[0]:.3g} to {predicted[1]:.3g}{unit}"
    return words


def _facts(recording: RecordedMotion) -> Iterator[Fact]:
    data, name = recording.data, recording.name
    used = int((data["use"] == 0).sum())
    note = f"{len(recording.along)} frames, {used} units; {data.attrs['alignment']}"
    yield number(f"{name}_frames", "Frames compared", len(recording.along), note=note)
    for dof, symbol in DOFS.items():
        unit = "rad" if dof == "theta" else "mm"
        off = {side: data["rmse"].sel(side=side, dof=dof) for side in ("simulated", "nominal")}
        value, low, high = (float(each) for each in off["simulated"].values)
        note = (
            f"95 %: {low:.3g} to {high:.3g}; against the problem as stated "
            f"{float(off['nominal'].sel(estimate='value')):.3g} {unit}"
        )
        yield number(f"{name}_rmse_{dof}", f"RMS residual of {symbol}", value, unit, note=note)
    for key, label in (
        ("nrmse", "RMS residual over RMS motion"),
        ("noise_share", "Share of the residual that is noise of the measurement"),
    ):
        values = data[key].sel(side="simulated", estimate="value").values
        note = "; ".join(
            f"{symbol} {100 * v:.3g} %" for symbol, v in zip(DOFS.values(), values, strict=True)
        )
        yield share(f"{name}_{key}", f"{label}, mean", float(np.nanmean(values)), note=note)
    values = data["correlation"].sel(side="simulated", estimate="value").values
    note = "of measured and simulated motion; the least of u_x, u_y and θ"
    yield number(f"{name}_correlation", "Correlation", float(np.nanmin(values)), note=note)
    yield from _alignment(recording)


def _alignment(recording: RecordedMotion) -> Iterator[Fact]:
    data, name = recording.data, recording.name
    lag = data["phase_lag"].sel(side="simulated", dof="uy", estimate="value")
    if np.isfinite(lag):
        yield number(f"{name}_phase", "Phase lag of u_y", float(np.degrees(lag)), "deg", digits=2)
    gain = float(data["drive_gain"])
    if np.isfinite(gain):
        note = "amplitude of the measured drive over that of the problem; not taken out"
        yield number(f"{name}_gain", "Gain of the drive", gain, note=note)
    scale, sigma = float(data["registration_scale"]), float(data["registration_scale_sigma"])
    note = f"± {sigma:.1g}, of the specimen against its design; not taken out"
    yield number(f"{name}_scale", "Scale", scale, digits=5, note=note)
    if int(data["band_samples"]):
        values = data["band_coverage"].values
        usual = 100 * float(np.nanmean(data["band_coverage_usual"].values))
        note = (
            f"mean of u_x, u_y and θ; band of {int(data['band_samples'])} simulations, of which"
            f" 95 % have {usual:.3g} % or more of their own motion within"
        )
        label = "Measurements within the band"
        yield share(f"{name}_coverage", label, float(np.nanmean(values)), note=note)
    force = float(data["force_rmse"].sel(side="simulated", estimate="value"))
    if np.isfinite(force):
        share_of = worded(
            100 * float(data["force_nrmse"].sel(side="simulated", estimate="value")), "%", 3
        )
        note = f"against the load cell; {share_of} of its root mean square"
        yield number(f"{name}_force", "RMS residual of the force", force, "N", digits=3, note=note)
