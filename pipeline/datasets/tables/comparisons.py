"""Lists variables of a recording with the simulation of the same motion."""

from __future__ import annotations

from dataclasses import replace

from pipeline.datasets.tables.designs import NETWORK
from pipeline.datasets.tables.tracks import RECORDED, TRACK
from pipeline.datasets.tables.variables import LABELS, UNIT, Table, Variable, names

_MOTION = ("time", "unit", "dof")
_MIXED = "mm (ux, uy), rad (theta)"
_OF_SIDE = ("side", "dof", "estimate")
_CURVE = ("source", "time", "estimate")


def _motion(long_name: str) -> Variable:
    return Variable(_MOTION, _MIXED, long_name, "float32", gaps=True)


def _metric(units: str, long_name: str) -> Variable:
    return Variable(_OF_SIDE, units, long_name, gaps=True)


def _scalar(units: str, long_name: str) -> Variable:
    return Variable((), units, long_name, gaps=True)


def _force(long_name: str) -> Variable:
    return Variable(("time",), "N", long_name, gaps=True)


_FRAMES: Table = {
    "time": replace(TRACK["time"], long_name="time of the frame since the start of the drive"),
    "frame": TRACK["frame"],
    "dof": LABELS["dof"],
    "side": names(
        "side",
        "simulation: driven by the measured motion of what holds the specimen; as the problem says",
        "simulated",
        "nominal",
    ),
    "source": names("source", "where a motion is from", "measured", "simulated", "nominal"),
    "estimate": names("estimate", "value and ends of its 95 % interval", "value", "low", "high"),
    "vertices": TRACK["vertices"],
    "use": Variable(
        ("unit",),
        "1",
        "whether the unit is compared, or why not",
        "int8",
        flags={"compared": 0, "clamped": 1, "driven": 2, "absent": 3, "lost": 4},
    ),
    "quality": TRACK["quality"],
    "branch": Variable(
        ("time",),
        "1",
        "which way the load goes; a motion in time has no branches",
        "int8",
        flags={"motion": 0, "loading": 1, "unloading": 2},
    ),
}

_MOTIONS: Table = {
    "measured": _motion("measured displacement, in the specimen's frame after registration"),
    "measured_sigma": _motion("standard uncertainty of the measured displacement"),
    "simulated": _motion("displacement simulated under the measured motion of supports and drive"),
    "nominal": _motion("displacement simulated as the problem says, at equal time or load"),
    "residual": _motion("measured less simulated displacement"),
    "band_low": _motion("lower end of the prediction band about the simulated displacement"),
    "band_high": _motion("upper end of the prediction band about the simulated displacement"),
    "drive_displacement": replace(
        TRACK["drive_displacement"], long_name="measured displacement of the driven units, mean"
    ),
    "nominal_drive": Variable(
        ("time", "xy"), "mm", "displacement of the driven units as the problem says", gaps=True
    ),
    "load_force": _force("force of the load cell along the drive, where there was one"),
    "simulated_force": _force("force of the drive along its direction, as simulated"),
    "nominal_force": _force("force of the drive along its direction, as the problem says"),
    "force_low": _force("lower end of the prediction band about the simulated force"),
    "force_high": _force("upper end of the prediction band about the simulated force"),
    "mean_rotation": Variable(
        _CURVE, "rad", "mean |theta| over the compared units of the region of interest", gaps=True
    ),
    "mean_displacement": Variable(
        _CURVE, "mm", "mean |u| over the compared units of the region of interest", gaps=True
    ),
    "contraction": Variable(
        _CURVE,
        "mm",
        "loss of distance between top and bottom units of the lattice's middle half",
        gaps=True,
    ),
    "mimicking_error": Variable(
        _CURVE,
        "1",
        "norm of U less that of the intact structure as the problem says, over the size of the"
        " latter, over the compared units of the region of interest",
        gaps=True,
    ),
}

_METRICS: Table = {
    "rmse": _metric(_MIXED, "root mean square of measured less simulated"),
    "nrmse": _metric("1", "the same over the root mean square of the measured motion"),
    "correlation": _metric("1", "correlation of measured and simulated motion"),
    "noise_share": _metric("1", "mean square of the measurement's noise over that of the residual"),
    "time_shift": _metric("s", "how far the measured motion is behind the simulated one"),
    "phase_lag": _metric("rad", "the same as a phase of the drive"),
    "force_rmse": Variable(
        ("side", "estimate"), "N", "root mean square of measured less simulated force", gaps=True
    ),
    "force_nrmse": Variable(
        ("side", "estimate"), "1", "the same over that of the measured force", gaps=True
    ),
    "rmse_map": Variable(
        ("side", "unit", "dof"), _MIXED, "root mean square residual of the unit", gaps=True
    ),
    "peak_to_peak": Variable(
        ("source", "unit", "dof", "estimate"),
        _MIXED,
        "largest less smallest displacement of the unit",
        gaps=True,
    ),
    "band_coverage": Variable(
        ("dof",), "1", "share of measurements within the band widened by their noise", gaps=True
    ),
    "band_coverage_usual": Variable(
        ("dof",),
        "1",
        "share of a simulation within the band that it was drawn from, or more, as often as the"
        " band's level says",
        gaps=True,
    ),
    "band_samples": Variable((), "1", "simulations that the band is drawn from", "int64"),
}

_ALIGNMENT: Table = {
    "registration_rotation": _scalar("rad", "turn of the measured places against the design"),
    "registration_rotation_sigma": _scalar("rad", "its standard uncertainty"),
    "registration_shift": Variable(("xy",), "mm", "their shift against the design", gaps=True),
    "registration_shift_sigma": Variable(("xy",), "mm", "its standard uncertainty", gaps=True),
    "registration_scale": _scalar("1", "their scale against the design, not taken out"),
    "registration_scale_sigma": _scalar("1", "its standard uncertainty"),
    "registration_residual": _scalar("mm", "root mean square of what registration leaves"),
    "pixel_size": _scalar("mm", "size of a pixel by the design's own lattice"),
    "pixel_size_stated": _scalar("mm", "size of a pixel that the recording states"),
    "time_lag": _scalar("s", "when the drive starts, since the start of the window"),
    "time_lag_sigma": _scalar("s", "its standard uncertainty"),
    "drive_correlation": _scalar("1", "correlation of measured and nominal drive"),
    "drive_gain": _scalar("1", "measured over nominal amplitude of the drive, not taken out"),
    "drive_gain_sigma": _scalar("1", "its standard uncertainty"),
    "drive_turn": _scalar("rad", "direction of the measured drive less that of the nominal one"),
}

COMPARISON: Table = UNIT | NETWORK | _FRAMES | _MOTIONS | _METRICS | _ALIGNMENT

COMPARED = RECORDED | {
    "title": "what the recording shows",
    "structure": "intact, altered or cloaked",
    "case": "number of the load case",
    "axis": "what both sides have in common: time or load",
    "alignment": "how they were aligned along it",
    "resampling": "which side was resampled, and how",
    "driving": "how the measured motion of supports and drive was filtered",
    "band": "what varies over the prediction band",
    "bootstrap": "how the intervals of the metrics were found",
}
"""Its attributes."""
